//! Checks that inputs and states match.

use super::input::Mounting;
use crate::navigation::state::{Optional, States, offset};
use bb_core::Fault;

/// Returns whether a set of states can be estimated at all, with any inputs.
pub(super) const fn is_possible<S: States>() -> bool {
    offset::<S>(Optional::RelativeScale).is_none() || offset::<S>(Optional::Keyframe).is_some()
}

/// Rejects a state that no input of the robot observes, and an input that needs a missing state.
pub(super) fn check<S: States>(mounting: &Mounting) -> Result<(), Fault> {
    for state in S::OPTIONAL {
        let (input, is_declared) = match state {
            Optional::Keyframe | Optional::RelativeScale => ("relative", mounting.relative.is_some()),
            Optional::GnssLeverArm | Optional::GnssDelay => ("gnss", mounting.gnss.is_some()),
            Optional::WheelScale | Optional::WheelMounting => ("odometry", mounting.odometry.is_some()),
            Optional::HardIron => ("magnetic_field", mounting.magnetic_field.is_some()),
            Optional::BarometerBias => ("pressure", mounting.pressure.is_some()),
        };
        if !is_declared {
            return Err(Fault::new(format!(
                "nothing tells the state `Optional::{state:?}`: declare the input `{input}`, or leave it out of the states"
            )));
        }
    }
    if S::OPTIONAL.is_empty() {
        return Ok(());
    }
    // Without its bias, a pressure would give the height the unjustified certainty of the first reading.
    let needed = [
        ("relative", mounting.relative, Optional::Keyframe),
        ("pressure", mounting.pressure, Optional::BarometerBias),
    ];
    for (input, sensor, state) in needed {
        if sensor.is_some() && offset::<S>(state).is_none() {
            return Err(Fault::new(format!(
                "the input `{input}` needs the state `Optional::{state:?}`: declare `Eskf<Odometry, S, {{ S::DIMENSION }}>` with \
                 states S that have it"
            )));
        }
    }
    Ok(())
}
