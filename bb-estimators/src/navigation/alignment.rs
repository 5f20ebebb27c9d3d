//! Initialises a filter from rest, or in motion from the specific force. [`Start::at`] initialises it from a given pose.
//!
//! P. D. Groves, "Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems", 2nd edition, 2013, section 5.6.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::eskf::{ImuMean, Start};
use super::math::{atan2, sqrt};
use super::refusal::Refusal;
use crate::attitude::initial::initial_orientation;
use crate::moments::Moments;
use crate::navigation::numbers::RECENT_FORCE_S;
use crate::params::params;

#[cfg(test)]
mod tests;

params! {
    /// Criteria of rest, and accuracy of the sensors at a start from rest.
    pub struct AlignmentParams {
        /// Least duration of the rest.
        ///
        /// Small: starts soon. Large: the bias of the gyroscope is better known.
        rest_time: f64 = 1.0, in 0.0..=1e6, unit "s";
        /// Largest variation of the angular velocity at rest, standard deviation of a component.
        ///
        /// Small: noise is taken for motion. Large: motion is taken for rest.
        ///
        /// Source: MEMS gyroscopes at 100 Hz have 0.002 rad/s.
        rest_rotation: f64 = 0.01, in 0.0..=1e3, unit "rad/s";
        /// Largest variation of the specific force at rest, standard deviation of a component.
        ///
        /// Small: noise is taken for motion. Large: motion is taken for rest.
        ///
        /// Source: MEMS accelerometers at 100 Hz have 0.02 m/s².
        rest_force: f64 = 0.1, in 0.0..=1e6, unit "m/s^2";
        /// The largest bias of the gyroscope: a faster steady rotation is not a bias. It counts as two standard deviations.
        largest_bias: f64 = 0.1, in 0.0..=1e3, unit "rad/s";
        /// Standard deviation of the accelerometer's bias.
        accelerometer_bias: f64 = 0.1, in 0.0..=1e3, unit "m/s^2";
        /// Horizontal acceleration in motion, which tilts the measured specific force.
        acceleration: f64 = 2.0, in 0.0..=1e3, unit "m/s^2";
        /// Gravity where the robot is.
        gravity: f64 = 9.80665, in 1.0..=30.0, unit "m/s^2";
    }
}

/// Gathers samples until a filter can be initialised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alignment {
    params: AlignmentParams,
    /// Statistics of the samples gathered so far.
    count: f64,
    first_ns: Option<i64>,
    last_ns: i64,
    rotation: Moments,
    force: Moments,
    /// Mean of the specific force over [`RECENT_FORCE_S`], whatever the motion.
    recent: Vector3<f64>,
}

impl Alignment {
    /// Creates an alignment without samples.
    pub fn new(params: AlignmentParams) -> Self {
        let (rotation, force) = (Moments::default(), Moments::default());
        Self { params, count: 0.0, first_ns: None, last_ns: i64::MIN, rotation, force, recent: Vector3::zeros() }
    }

    /// Adds a sample. A sample that shows motion restarts the rest interval.
    ///
    /// # Errors
    ///
    /// Returns a [`Refusal`] if a value is not finite or time does not increase. The alignment is then unchanged.
    pub fn add(&mut self, sample: &ImuMean) -> Result<(), Refusal> {
        let ImuMean { time_ns, angular_velocity, specific_force } = sample;
        if !angular_velocity.iter().chain(specific_force.iter()).all(|x| x.abs() < 1e6) {
            return Err(Refusal::NonFinite);
        }
        if self.first_ns.is_some() && *time_ns <= self.last_ns {
            return Err(Refusal::TimeNotIncreasing { previous_ns: self.last_ns, time_ns: *time_ns });
        }
        let mut longer = *self;
        longer.first_ns = self.first_ns.or(Some(*time_ns));
        longer.last_ns = *time_ns;
        longer.count += 1.0;
        longer.rotation.add(longer.count, angular_velocity);
        longer.force.add(longer.count, specific_force);
        let dt = self.first_ns.map_or(f64::INFINITY, |_| time_ns.saturating_sub(self.last_ns) as f64 * 1e-9);
        let share = if dt.is_finite() { dt / (dt + RECENT_FORCE_S) } else { 1.0 };
        longer.recent += (specific_force - longer.recent) * share;
        let recent = longer.recent;
        *self = if longer.is_still() { longer } else { Self::new(self.params).beginning_with(sample) };
        self.recent = recent;
        Ok(())
    }

    /// Returns the time for which the body has been at rest, s.
    pub fn rest_s(&self) -> f64 {
        self.first_ns.map_or(0.0, |first_ns| self.last_ns.saturating_sub(first_ns) as f64 * 1e-9)
    }

    /// Initialises from rest: the tilt from gravity, the gyroscope bias from its mean reading.
    ///
    /// `position` (m) and `heading` (rad, of the body's x axis, from east counter-clockwise) come with their standard deviations.
    ///
    /// # Errors
    ///
    /// Returns [`Refusal::NotObservable`] if the rest has not lasted long enough or the body's x axis is vertical.
    pub fn at_rest(&self, position: (Vector3<f64>, f64), heading: (f64, f64)) -> Result<Start, Refusal> {
        let AlignmentParams { rest_time, largest_bias, accelerometer_bias, gravity, .. } = self.params;
        if self.rest_s() < rest_time || self.rotation.mean.norm() > largest_bias {
            return Err(Refusal::NotObservable);
        }
        let world_from_body = orientation(&self.force.mean, heading.0)?;
        let tilt = accelerometer_bias / gravity;
        let start = Start::at(self.last_ns, position, (Vector3::zeros(), 0.02), (world_from_body, tilt));
        let bias = sqrt(self.rotation.largest_variance(self.count)) / sqrt(self.count);
        Ok(Start {
            gyroscope_bias: self.rotation.mean,
            // Non-white noise does not average out, so the bias is never known better than this.
            gyroscope_bias_deviation: bias.max(1e-4),
            accelerometer_bias_deviation: accelerometer_bias,
            rotation_covariance: rotation_covariance(tilt, heading.1),
            ..start
        })
    }

    /// Initialises in motion: the tilt from the mean specific force of the last half second, which the motion bends.
    ///
    /// `position` and `velocity` in the world, m and m/s, and `heading`, rad, of the body's x axis, from east counter-clockwise, come
    /// with their standard deviations.
    ///
    /// # Errors
    ///
    /// Returns [`Refusal::NotObservable`] without a sample, in free fall, or if the body's x axis is vertical.
    pub fn in_motion(
        &self,
        position: (Vector3<f64>, f64),
        velocity: (Vector3<f64>, f64),
        heading: (f64, f64),
    ) -> Result<Start, Refusal> {
        let AlignmentParams { accelerometer_bias, acceleration, gravity, largest_bias, .. } = self.params;
        if self.first_ns.is_none() {
            return Err(Refusal::NotObservable);
        }
        let world_from_body = orientation(&self.recent, heading.0)?;
        let tilt = (accelerometer_bias + acceleration) / gravity;
        Ok(Start {
            gyroscope_bias_deviation: 0.5 * largest_bias,
            accelerometer_bias_deviation: accelerometer_bias,
            rotation_covariance: rotation_covariance(tilt, heading.1),
            ..Start::at(self.last_ns, position, velocity, (world_from_body, tilt))
        })
    }

    fn is_still(&self) -> bool {
        sqrt(self.rotation.largest_variance(self.count)) <= self.params.rest_rotation
            && sqrt(self.force.largest_variance(self.count)) <= self.params.rest_force
    }

    fn beginning_with(mut self, sample: &ImuMean) -> Self {
        self.first_ns = Some(sample.time_ns);
        self.last_ns = sample.time_ns;
        self.count = 1.0;
        self.rotation.mean = sample.angular_velocity;
        self.force.mean = sample.specific_force;
        self
    }
}

/// The level attitude in which the body's x axis points at `heading`.
fn orientation(force: &Vector3<f64>, heading: f64) -> Result<UnitQuaternion<f64>, Refusal> {
    let level = initial_orientation(force, None).map_err(|_| Refusal::NotObservable)?;
    let ahead = level * Vector3::x();
    if ahead.xy().norm() < 1e-3 || !heading.is_finite() {
        return Err(Refusal::NotObservable);
    }
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading - atan2(ahead.y, ahead.x));
    Ok(turn * level)
}

/// Covariance in world axes: tilt about the horizontal axes, heading about the vertical axis.
fn rotation_covariance(tilt: f64, heading: f64) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(tilt * tilt, tilt * tilt, heading * heading))
}
