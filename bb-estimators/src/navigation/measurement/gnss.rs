//! Satellite navigation: position and velocity of an antenna, heading of an antenna pair.

use nalgebra::{Matrix3, Vector3};

use super::{Linearised, Measurement};
use crate::navigation::math::{atan2, skew, wrapped};
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, GYROSCOPE_BIAS, Optional, POSITION, ROTATION, States, VELOCITY, offset};

/// A horizontal direction shorter than this, as a fraction or in m, has no heading.
const LEAST_HORIZONTAL: f64 = 1e-3;

/// Position of an antenna in the world.
///
/// With the antenna at `l` in the body: `p + R l`, less the distance `(v + R (ω × l)) d - ½ a d²` travelled during its delay d, with
/// the [acceleration](Estimate::acceleration) a.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GnssPosition {
    /// Position of the antenna in the world, m.
    pub position: Vector3<f64>,
    /// Covariance in the world, m².
    pub covariance: Matrix3<f64>,
    /// Lever arm of the antenna in the body, m; [`Optional::GnssLeverArm`] adds its estimated error.
    pub lever_arm: Vector3<f64>,
}

impl GnssPosition {
    /// A position with horizontal and vertical standard deviations, m, of an antenna at the body's origin.
    pub fn new(position: Vector3<f64>, horizontal: f64, vertical: f64) -> Self {
        let deviations = Vector3::new(horizontal, horizontal, vertical);
        let covariance = Matrix3::from_diagonal(&deviations.component_mul(&deviations));
        Self { position, covariance, lever_arm: Vector3::zeros() }
    }
}

impl Measurement<3> for GnssPosition {
    fn linearise<S: States, const N: usize>(
        &self,
        at: &Estimate<N>,
        model: &mut Linearised<3, N>,
    ) -> Result<(), Refusal> {
        let rotation = at.rotation();
        let in_body = self.lever_arm + at.vector::<S>(Optional::GnssLeverArm);
        let lever_arm = rotation * in_body;
        let swing = rotation * at.angular_velocity.cross(&in_body);
        let velocity = at.velocity + swing;
        let delay = at.scalar::<S>(Optional::GnssDelay);
        let bent = at.acceleration * delay;
        let travelled = (velocity - bent * 0.5) * delay;
        model.set_residual(0, &(self.position - at.position - lever_arm + travelled));
        model.set_noise(0, &self.covariance);
        model.set_block(0, POSITION, &Matrix3::identity());
        model.set_block(0, ROTATION, &-skew(&(lever_arm - swing * delay)));
        if let Some(index) = offset::<S>(Optional::GnssLeverArm) {
            model.set_block(0, index, &(rotation - rotation * skew(&at.angular_velocity) * delay));
        }
        if let Some(index) = offset::<S>(Optional::GnssDelay) {
            model.set_block(0, VELOCITY, &(Matrix3::identity() * -delay));
            model.set_block(0, GYROSCOPE_BIAS, &(rotation * skew(&in_body) * -delay));
            model.set_column(0, index, &(bent - velocity));
        }
        Ok(())
    }
}

/// Velocity of an antenna in the world: `v + R (ω × l)`, less the change `(a + R (ω × (ω × l))) d` during its delay d, with
/// the [acceleration](Estimate::acceleration) a.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GnssVelocity {
    /// Velocity of the antenna in the world, m/s.
    pub velocity: Vector3<f64>,
    /// Covariance in the world, m²/s².
    pub covariance: Matrix3<f64>,
    /// Lever arm of the antenna in the body, m; [`Optional::GnssLeverArm`] adds its estimated error.
    pub lever_arm: Vector3<f64>,
}

impl GnssVelocity {
    /// A velocity with horizontal and vertical standard deviations, m/s, of an antenna at the body's origin.
    pub fn new(velocity: Vector3<f64>, horizontal: f64, vertical: f64) -> Self {
        let GnssPosition { covariance, lever_arm, .. } = GnssPosition::new(velocity, horizontal, vertical);
        Self { velocity, covariance, lever_arm }
    }
}

impl Measurement<3> for GnssVelocity {
    fn linearise<S: States, const N: usize>(
        &self,
        at: &Estimate<N>,
        model: &mut Linearised<3, N>,
    ) -> Result<(), Refusal> {
        let rotation = at.rotation();
        let in_body = self.lever_arm + at.vector::<S>(Optional::GnssLeverArm);
        let swing = rotation * at.angular_velocity.cross(&in_body);
        let delay = at.scalar::<S>(Optional::GnssDelay);
        let turning = skew(&at.angular_velocity);
        let pull = rotation * (turning * (turning * in_body));
        let acceleration = at.acceleration + pull;
        model.set_residual(0, &(self.velocity - at.velocity - swing + acceleration * delay));
        model.set_noise(0, &self.covariance);
        model.set_block(0, VELOCITY, &Matrix3::identity());
        model.set_block(0, ROTATION, &-skew(&(swing - pull * delay)));
        let arm = skew(&in_body);
        let of_pull = skew(&at.angular_velocity.cross(&in_body)) + turning * arm;
        model.set_block(0, GYROSCOPE_BIAS, &(rotation * (arm - of_pull * delay)));
        if let Some(index) = offset::<S>(Optional::GnssLeverArm) {
            model.set_block(0, index, &(rotation * (turning - turning * turning * delay)));
        }
        if let Some(index) = offset::<S>(Optional::GnssDelay) {
            model.set_column(0, index, &-acceleration);
        }
        Ok(())
    }
}

/// Heading of the line from one antenna to another: that of `R (b - (ω × b) d)`, with the baseline b and the delay d.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GnssHeading {
    /// Heading from the world's x axis, east, counter-clockwise, rad; any number of turns.
    pub heading: f64,
    /// Standard deviation, rad.
    pub deviation: f64,
    /// Vector from the first antenna to the second, in the body, of any non-zero length.
    pub baseline: Vector3<f64>,
}

impl Measurement<1> for GnssHeading {
    fn linearise<S: States, const N: usize>(
        &self,
        at: &Estimate<N>,
        model: &mut Linearised<1, N>,
    ) -> Result<(), Refusal> {
        let baseline = self.baseline.try_normalize(1e-12).ok_or(Refusal::NonFinite)?;
        let delay = at.scalar::<S>(Optional::GnssDelay);
        let turning = at.world_from_body * at.angular_velocity.cross(&baseline);
        let direction = at.world_from_body * baseline - turning * delay;
        let (heading, gradient) = heading_of(&direction).ok_or(Refusal::NotObservable)?;
        model.residual[0] = wrapped(self.heading - heading);
        model.noise[(0, 0)] = self.deviation * self.deviation;
        // The rotation error θ changes the world vector w by θ × w.
        model.set_row(0, ROTATION, &direction.cross(&gradient));
        if let Some(index) = offset::<S>(Optional::GnssDelay) {
            let in_body = at.world_from_body.inverse() * gradient;
            model.set_row(0, GYROSCOPE_BIAS, &(baseline.cross(&in_body) * delay));
            model.jacobian[0][index] = -turning.dot(&gradient);
        }
        Ok(())
    }
}

/// The heading of a world vector, rad, and its derivative with respect to that vector; `None` if the vector is vertical.
pub(super) fn heading_of(vector: &Vector3<f64>) -> Option<(f64, Vector3<f64>)> {
    let squared = vector.x * vector.x + vector.y * vector.y;
    if squared <= LEAST_HORIZONTAL * LEAST_HORIZONTAL * vector.norm_squared() {
        return None;
    }
    Some((atan2(vector.y, vector.x), Vector3::new(-vector.y, vector.x, 0.0) / squared))
}
