//! `ATTITUDE_QUATERNION`.

use super::stream::Stream;
use crate::axes::world_from_body;
use crate::link::Peer;
use crate::stamps::{Stamps, Unit};
use bb_core::nalgebra::{Quaternion, UnitQuaternion};
use bb_core::payload::Orientation;
use bb_core::{Fault, MonotonicTime, Options, Reading, Sensor, SensorContext};
use mavlink::MessageData;
use mavlink::dialects::ardupilotmega::{ATTITUDE_QUATERNION_DATA, MavMessage};
use std::time::Duration;

/// Options of [`MavlinkAttitude`].
#[derive(Clone, Debug, Options)]
pub struct MavlinkAttitudeOptions {
    /// Address of the flight controller: see [`Address`](crate::Address).
    #[option(required)]
    pub link: String,
    /// System that sends; 0 for any.
    #[option(default = 1)]
    pub system_id: u8,
    /// Component that sends; 0 for any.
    #[option(default = 1)]
    pub component_id: u8,
    /// Time for which it may send nothing that can be used.
    #[option(default = Duration::from_secs(1))]
    pub timeout: Duration,
}

/// The attitude estimated by the flight controller, as `world_from_body`: from forward, left, up to east, north, up.
///
/// A quaternion whose norm differs from 1 by more than 1 % is not a reading. The offset for displays
/// (`repr_offset_q`) is not applied.
#[derive(Debug)]
pub struct MavlinkAttitude {
    stream: Stream,
    stamps: Stamps,
}

impl Sensor for MavlinkAttitude {
    type Options = MavlinkAttitudeOptions;
    type Output = Orientation;

    fn init(options: MavlinkAttitudeOptions, context: &SensorContext) -> Result<Self, Fault> {
        let message = (ATTITUDE_QUATERNION_DATA::NAME, ATTITUDE_QUATERNION_DATA::ID);
        let peer = Peer { system_id: options.system_id, component_id: options.component_id };
        let stream = Stream::open(&options.link, peer, &[message], options.timeout, context)?;
        Ok(Self { stream, stamps: Stamps::new(Unit::Millis, options.timeout) })
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Orientation>, Fault> {
        let Some(received) = self.stream.next()? else { return Ok(Reading::nothing()) };
        let MavMessage::ATTITUDE_QUATERNION(data) = &received.message else { return Ok(Reading::nothing()) };
        let Some(orientation) = orientation(data) else {
            return self.stream.has_none("it is not a unit quaternion").map(|()| Reading::nothing());
        };
        let ticks = data.time_boot_ms.into();
        match self.stamps.time_of(ticks, received.arrival).map_err(|fault| self.stream.fault(fault))? {
            Some(time) => {
                self.stream.has_value();
                Ok(Reading::at(time, orientation))
            }
            None => self.stream.has_none("stamps are repeated or out of order").map(|()| Reading::nothing()),
        }
    }
}

fn orientation(data: &ATTITUDE_QUATERNION_DATA) -> Option<Orientation> {
    let [w, i, j, k] = [data.q1, data.q2, data.q3, data.q4].map(f64::from);
    let quaternion = Quaternion::new(w, i, j, k);
    // NaN is rejected as well.
    let is_unit = (quaternion.norm() - 1.0).abs() <= 0.01;
    is_unit.then(|| Orientation::new(world_from_body(&UnitQuaternion::from_quaternion(quaternion))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use bb_core::nalgebra::Vector3;

    fn data([q1, q2, q3, q4]: [f32; 4]) -> ATTITUDE_QUATERNION_DATA {
        ATTITUDE_QUATERNION_DATA { q1, q2, q3, q4, ..Default::default() }
    }

    #[test]
    fn headings_are_clockwise_from_north_there_and_here_the_same_direction() {
        // Facing east, level: a quarter turn about down.
        let half = std::f32::consts::FRAC_1_SQRT_2;
        let east = orientation(&data([half, 0.0, 0.0, half])).expect("it is a unit quaternion").world_from_body;
        assert!((east * Vector3::x() - Vector3::x()).norm() < 1e-7, "forward is east");
        assert!((east * Vector3::z() - Vector3::z()).norm() < 1e-7, "up is up");
        // Nose up by 30 degrees, facing north.
        let (sin, cos) = 15_f32.to_radians().sin_cos();
        let climbing = orientation(&data([cos, 0.0, sin, 0.0])).expect("it is a unit quaternion").world_from_body;
        let forward = climbing * Vector3::x();
        assert!((forward - Vector3::new(0.0, 0.75_f64.sqrt(), 0.5)).norm() < 1e-7, "{forward}");
    }

    #[test]
    fn what_is_no_rotation_is_none() {
        for wrong in [[0.0; 4], [1.02, 0.0, 0.0, 0.0], [f32::NAN, 0.0, 0.0, 1.0], [f32::INFINITY, 0.0, 0.0, 0.0]] {
            assert_eq!(orientation(&data(wrong)), None, "{wrong:?}");
        }
    }
}
