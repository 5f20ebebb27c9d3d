//! Initial state of a filter.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::params::EskfParams;
use crate::navigation::covariance::Covariance;
use crate::navigation::math::unit;
use crate::navigation::numbers::{MOST_PITCH, START_ACCELEROMETER_BIAS, START_GYROSCOPE_BIAS};
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{
    ACCELEROMETER_BIAS, Estimate, GYROSCOPE_BIAS, Optional, POSITION, ROTATION, States, VELOCITY, offset,
};

/// The state and uncertainty that a filter starts with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start {
    /// Time of the start, nanoseconds since any fixed epoch.
    pub time_ns: i64,
    /// Position in the world, m.
    pub position: Vector3<f64>,
    /// Velocity in the world, m/s.
    pub velocity: Vector3<f64>,
    /// Rotates body coordinates to world coordinates.
    pub world_from_body: UnitQuaternion<f64>,
    /// Bias of the accelerometer, body axes, m/s².
    pub accelerometer_bias: Vector3<f64>,
    /// Bias of the gyroscope, body axes, rad/s.
    pub gyroscope_bias: Vector3<f64>,
    /// Covariance of the position, m².
    pub position_covariance: Matrix3<f64>,
    /// Covariance of the velocity, m²/s².
    pub velocity_covariance: Matrix3<f64>,
    /// Covariance of the rotation error, world axes, rad².
    pub rotation_covariance: Matrix3<f64>,
    /// Standard deviation of the accelerometer's bias, m/s².
    pub accelerometer_bias_deviation: f64,
    /// Standard deviation of the gyroscope's bias, rad/s.
    pub gyroscope_bias_deviation: f64,
}

impl Start {
    /// Creates a start from a pose and velocity with isotropic standard deviations, m, m/s, rad. Biases are zero, with standard
    /// deviations of 0.2 m/s² and 0.02 rad/s.
    pub fn at(
        time_ns: i64,
        position: (Vector3<f64>, f64),
        velocity: (Vector3<f64>, f64),
        world_from_body: (UnitQuaternion<f64>, f64),
    ) -> Self {
        let isotropic = |deviation: f64| Matrix3::identity() * (deviation * deviation);
        Self {
            time_ns,
            position: position.0,
            velocity: velocity.0,
            world_from_body: world_from_body.0,
            accelerometer_bias: Vector3::zeros(),
            gyroscope_bias: Vector3::zeros(),
            position_covariance: isotropic(position.1),
            velocity_covariance: isotropic(velocity.1),
            rotation_covariance: isotropic(world_from_body.1),
            accelerometer_bias_deviation: START_ACCELEROMETER_BIAS,
            gyroscope_bias_deviation: START_GYROSCOPE_BIAS,
        }
    }

    /// The corresponding state and covariance.
    pub(super) fn state<S: States, const N: usize>(
        &self,
        params: &EskfParams,
    ) -> Result<(Estimate<N>, Covariance<N>), Refusal> {
        let mut covariance = Covariance::new();
        covariance.set(POSITION, &self.position_covariance);
        covariance.set(VELOCITY, &self.velocity_covariance);
        covariance.set(ROTATION, &self.rotation_covariance);
        for i in 0..3 {
            let square = |x: f64| x * x;
            covariance.forget(ACCELEROMETER_BIAS + i, square(self.accelerometer_bias_deviation));
            covariance.forget(GYROSCOPE_BIAS + i, square(self.gyroscope_bias_deviation));
        }
        for state in S::OPTIONAL {
            let Some(first) = offset::<S>(*state) else { continue };
            let variance = params.variance(*state);
            (first..first + state.dimension()).for_each(|i| covariance.forget(i, variance));
            if *state == Optional::WheelMounting {
                // Nobody mounts an IMU with any pitch.
                covariance.forget(first + 1, variance.min(MOST_PITCH * MOST_PITCH));
            }
        }
        let world_from_body = unit(&self.world_from_body).ok_or(Refusal::NonFinite)?;
        let estimate = Estimate {
            time_ns: self.time_ns,
            position: self.position,
            velocity: self.velocity,
            world_from_body,
            accelerometer_bias: self.accelerometer_bias,
            gyroscope_bias: self.gyroscope_bias,
            ..Estimate::unknown()
        };
        estimate.check()?;
        if !covariance.is_positive_definite() {
            return Err(Refusal::Noise);
        }
        Ok((estimate, covariance))
    }

    /// The corresponding state and information matrix, the inverse of the covariance.
    pub(in crate::navigation) fn information<S: States, const N: usize>(
        &self,
        params: &EskfParams,
    ) -> Result<(Estimate<N>, nalgebra::SMatrix<f64, N, N>), Refusal> {
        let (estimate, covariance) = self.state::<S, N>(params)?;
        let information = nalgebra::linalg::Cholesky::new(*covariance.matrix()).ok_or(Refusal::Noise)?;
        Ok((estimate, information.inverse()))
    }
}
