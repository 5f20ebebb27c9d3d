//! States that the inputs bring, and those that they allow.

use super::input::Setup;
use super::life::{Limits, Running, Runs, Sensed};
use super::options::NavigationOptions;
use super::starting::Starting;
use crate::navigation::eskf::{EskfFilter, Start};
use crate::navigation::geodesy::LocalFrame;
use crate::navigation::state::{Aided, Complete, Navigation, Optional, States, Vehicle, offset};
use bb_core::Fault;
use std::any::TypeId;

/// Number of states in the history. Each is a filter with all its states: more would take many hundred kilobytes.
const STATES: usize = 8;

/// A filter that has started.
pub(super) type Started = Result<Box<dyn Runs<Starting>>, Fault>;

/// Returns whether a set of states can be estimated at all, with any inputs.
pub(super) const fn is_possible<S: States>() -> bool {
    offset::<S>(Optional::RelativeScale).is_none() || offset::<S>(Optional::Keyframe).is_some()
}

/// Rejects a state that no input of the robot observes, and an input that needs a missing state.
pub(super) fn check<S: States>(setup: &Setup) -> Result<(), Fault> {
    for state in S::OPTIONAL {
        let (input, is_declared) = match state {
            Optional::Keyframe | Optional::RelativeScale => ("relative", setup.relative.is_some()),
            Optional::GnssLeverArm | Optional::GnssDelay => ("gnss", setup.gnss.is_some()),
            Optional::WheelScale | Optional::WheelMounting => ("odometry", setup.odometry.is_some()),
            Optional::HardIron => ("magnetic_field", setup.magnetic_field.is_some()),
            Optional::BarometerBias => ("pressure", setup.pressure.is_some()),
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
    let needed =
        [("relative", setup.relative, Optional::Keyframe), ("pressure", setup.pressure, Optional::BarometerBias)];
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

/// A filter that has started. Unless states are declared, they are those that the inputs bring.
pub(super) fn started<S: States + Send + 'static, const N: usize>(
    setup: &Setup,
    start: &Start,
    frame: Option<LocalFrame>,
) -> Started {
    if TypeId::of::<S>() == TypeId::of::<Navigation>() {
        provided(setup, start, frame)
    } else {
        running::<S, N>(setup, start, frame)
    }
}

/// A filter with states that this crate provides. It is compiled with this crate and its optimisation level, not with the robot, which
/// may be a debug build.
fn provided(setup: &Setup, start: &Start, frame: Option<LocalFrame>) -> Started {
    // Without wheels, nothing tells how the IMU is mounted on them; and a delay is that of a receiver.
    let wheel_mounting = if setup.odometry.is_some() { setup.options.wheel_mounting } else { 0.0 };
    let gnss_delay = if setup.has_receiver() { setup.options.gnss_delay } else { 0.0 };
    let setup = &Setup { options: NavigationOptions { wheel_mounting, gnss_delay, ..setup.options }, ..*setup };
    if setup.relative.is_some() {
        running::<Complete, { Complete::DIMENSION }>(setup, start, frame)
    } else if setup.odometry.is_some() {
        running::<Vehicle, { Vehicle::DIMENSION }>(setup, start, frame)
    } else {
        running::<Aided, { Aided::DIMENSION }>(setup, start, frame)
    }
}

fn running<S: States + Send + 'static, const N: usize>(
    setup: &Setup,
    start: &Start,
    frame: Option<LocalFrame>,
) -> Started {
    let options = &setup.options;
    let sensed = Sensed::<EskfFilter<S, N>>::new(options.params(), start, options.odometry_correlation)?;
    let dead_reckoning_s = setup.has_positions().then_some(options.longest_dead_reckoning);
    let limits = Limits { dead_reckoning_s, deviation: options.largest_deviation };
    Ok(Box::new(Running::<_, STATES>::new(sensed, limits, frame)?))
}
