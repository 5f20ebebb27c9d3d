//! Measurement models for a robot on a plane, each with a residual, a Jacobian and a noise covariance.

use nalgebra::{Matrix2, Matrix3, Vector2};

use super::estimate::{GYROSCOPE_BIAS, HEADING, POSITION, PlanarEstimate, STATES, VELOCITY, WHEEL_SCALE, left};
use crate::navigation::math::wrapped;
use crate::navigation::measurement::Linearised;
use crate::navigation::refusal::Refusal;

/// A measurement with `D` components. You can add your own, as with [`Measurement`](crate::navigation::Measurement).
///
/// ```
/// use bb_estimators::navigation::planar::{HEADING, PlanarEstimate, PlanarMeasurement, STATES};
/// use bb_estimators::navigation::{Linearised, Refusal};
///
/// /// A wall along the world's x axis, seen by a camera: the heading up to half a turn.
/// struct Wall {
///     angle_rad: f64,
///     deviation_rad: f64,
/// }
///
/// impl PlanarMeasurement<1> for Wall {
///     fn linearise(&self, at: &PlanarEstimate, model: &mut Linearised<1, STATES>) -> Result<(), Refusal> {
///         model.residual[0] = 0.5 * (2.0 * (self.angle_rad - at.heading)).sin();
///         model.jacobian[0][HEADING] = (2.0 * (self.angle_rad - at.heading)).cos();
///         model.noise[(0, 0)] = self.deviation_rad * self.deviation_rad;
///         Ok(())
///     }
/// }
/// ```
pub trait PlanarMeasurement<const D: usize> {
    /// Compares the measurement with the prediction from the estimate.
    ///
    /// # Errors
    ///
    /// Returns the reason why this is impossible: [`Refusal::NotObservable`] if the measurement carries no information in this
    /// state.
    fn linearise(&self, at: &PlanarEstimate, model: &mut Linearised<D, STATES>) -> Result<(), Refusal>;
}

/// Position of a point of the body in the world: `p + R l`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarPosition {
    /// Position in the world, m.
    pub position: Vector2<f64>,
    /// Covariance in the world, m².
    pub covariance: Matrix2<f64>,
    /// Lever arm of the point in the body, m, such as that of an antenna.
    pub lever_arm: Vector2<f64>,
}

/// Velocity from wheel odometry, at a point of the body: `(1 + s) (v + ω × l)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelVelocity {
    /// Velocity in the body, x forward, y left, m/s.
    pub velocity: Vector2<f64>,
    /// Covariance in the body, m²/s².
    pub covariance: Matrix2<f64>,
    /// The point, in the body, that the velocity refers to, m: between wheels that are not steered.
    pub lever_arm: Vector2<f64>,
}

/// Yaw rate from wheel odometry, or of a robot at rest. It makes the gyroscope's bias observable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct YawRate {
    /// Yaw rate, counter-clockwise, rad/s.
    pub rate: f64,
    /// Standard deviation, the gyroscope's noise in one sample included, rad/s.
    pub deviation: f64,
}

/// Heading of the body's x axis, from a compass, two antennas, or an attitude filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarHeading {
    /// Heading from the world's x axis, east, counter-clockwise, rad; any number of turns.
    pub heading: f64,
    /// Standard deviation, rad.
    pub deviation: f64,
}

/// Position and heading of the body, from a map or a tracking system.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarPose {
    /// Position of the body's origin in the world, m.
    pub position: Vector2<f64>,
    /// Heading of the body's x axis, from the world's x axis counter-clockwise, rad; any number of turns.
    pub heading: f64,
    /// Covariance: position in the world, m², then heading, rad².
    pub covariance: Matrix3<f64>,
}

impl PlanarPosition {
    /// A position of the body's origin with isotropic noise, standard deviation in m.
    pub fn new(position: Vector2<f64>, deviation: f64) -> Self {
        Self { position, covariance: isotropic(deviation), lever_arm: Vector2::zeros() }
    }
}

impl WheelVelocity {
    /// A velocity of the body's origin with isotropic noise, standard deviation in m/s.
    pub fn new(velocity: Vector2<f64>, deviation: f64) -> Self {
        Self { velocity, covariance: isotropic(deviation), lever_arm: Vector2::zeros() }
    }
}

impl PlanarMeasurement<2> for PlanarPosition {
    fn linearise(&self, at: &PlanarEstimate, model: &mut Linearised<2, STATES>) -> Result<(), Refusal> {
        let lever_arm = at.world_from_body() * self.lever_arm;
        let residual = self.position - at.position - lever_arm;
        let by_heading = left(&lever_arm);
        for i in 0..2 {
            model.residual[i] = residual[i];
            model.jacobian[i][POSITION + i] = 1.0;
            model.jacobian[i][HEADING] = by_heading[i];
        }
        model.noise = self.covariance;
        Ok(())
    }
}

impl PlanarMeasurement<2> for WheelVelocity {
    fn linearise(&self, at: &PlanarEstimate, model: &mut Linearised<2, STATES>) -> Result<(), Refusal> {
        let scale = 1.0 + at.wheel_scale;
        let velocity = at.velocity_at(&self.lever_arm);
        let by_rate = left(&self.lever_arm);
        for i in 0..2 {
            model.residual[i] = self.velocity[i] - scale * velocity[i];
            model.jacobian[i][VELOCITY + i] = scale;
            model.jacobian[i][GYROSCOPE_BIAS] = -scale * by_rate[i];
            model.jacobian[i][WHEEL_SCALE] = velocity[i];
        }
        model.noise = self.covariance;
        Ok(())
    }
}

impl PlanarMeasurement<1> for YawRate {
    fn linearise(&self, at: &PlanarEstimate, model: &mut Linearised<1, STATES>) -> Result<(), Refusal> {
        model.residual[0] = self.rate - at.yaw_rate;
        model.jacobian[0][GYROSCOPE_BIAS] = -1.0;
        model.noise[(0, 0)] = self.deviation * self.deviation;
        Ok(())
    }
}

impl PlanarMeasurement<1> for PlanarHeading {
    fn linearise(&self, at: &PlanarEstimate, model: &mut Linearised<1, STATES>) -> Result<(), Refusal> {
        model.residual[0] = wrapped(self.heading - at.heading);
        model.jacobian[0][HEADING] = 1.0;
        model.noise[(0, 0)] = self.deviation * self.deviation;
        Ok(())
    }
}

impl PlanarMeasurement<3> for PlanarPose {
    fn linearise(&self, at: &PlanarEstimate, model: &mut Linearised<3, STATES>) -> Result<(), Refusal> {
        let residual = self.position - at.position;
        model.residual = [residual.x, residual.y, wrapped(self.heading - at.heading)];
        for i in 0..3 {
            model.jacobian[i][POSITION + i] = 1.0;
        }
        model.noise = self.covariance;
        Ok(())
    }
}

fn isotropic(deviation: f64) -> Matrix2<f64> {
    Matrix2::identity() * (deviation * deviation)
}
