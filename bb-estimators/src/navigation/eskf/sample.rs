//! IMU samples: means over an interval.

use nalgebra::Vector3;

use crate::attitude::{MAX_ANGULAR_VELOCITY, MAX_SPECIFIC_FORCE};
use crate::navigation::refusal::Refusal;

/// One IMU sample, body axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuMean {
    /// The end of the interval, nanoseconds since any fixed epoch. The interval begins at the end of the previous one.
    pub time_ns: i64,
    /// Mean angular velocity over the interval, rad/s.
    pub angular_velocity: Vector3<f64>,
    /// Mean specific force over the interval, m/s²: at rest one g upwards.
    pub specific_force: Vector3<f64>,
}

impl ImuMean {
    /// Checks that a sensor could have measured these values.
    pub(in crate::navigation) fn check(&self) -> Result<(), Refusal> {
        // The range check also rejects NaN.
        let within = |vector: &Vector3<f64>, limit: f64| vector.iter().all(|x| (-limit..=limit).contains(x));
        if within(&self.angular_velocity, MAX_ANGULAR_VELOCITY) && within(&self.specific_force, MAX_SPECIFIC_FORCE)
        {
            return Ok(());
        }
        let mut components = self.angular_velocity.iter().chain(self.specific_force.iter());
        let is_finite = components.all(|x| x.is_finite());
        Err(if is_finite { Refusal::OutOfRange } else { Refusal::NonFinite })
    }
}

/// The time from one stamp to a later one, s.
pub(in crate::navigation) fn seconds_between(previous_ns: i64, time_ns: i64) -> Result<f64, Refusal> {
    if time_ns <= previous_ns {
        return Err(Refusal::TimeNotIncreasing { previous_ns, time_ns });
    }
    // The difference of two stamps can be wider than their type.
    Ok(time_ns.checked_sub(previous_ns).unwrap_or(i64::MAX) as f64 * 1e-9)
}
