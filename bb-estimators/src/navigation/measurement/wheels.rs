//! Velocity in the body: wheels, their kinematic constraints, and sensors that observe the ground.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::{Linearised, Measurement, isotropic};
use crate::navigation::math::skew;
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, GYROSCOPE_BIAS, Optional, ROTATION, States, VELOCITY, offset};

/// Velocity of a point of the body, in the axes of a sensor: `Mᵀ (Rᵀ v + ω × l)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyVelocity {
    /// Velocity in the sensor's axes, m/s.
    pub velocity: Vector3<f64>,
    /// Standard deviation of a component, m/s.
    pub deviation: f64,
    /// Rotates sensor coordinates to body coordinates, M.
    pub body_from_sensor: UnitQuaternion<f64>,
    /// Position of the sensor in the body, m.
    pub lever_arm: Vector3<f64>,
}

/// Speed of a wheel, or of the middle of an axle, along a direction of the body: `(1 + s) eᵀ (Rᵀ v + ω × l)`, with
/// [`Optional::WheelScale`] s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelSpeed {
    /// Speed, forward positive, m/s.
    pub speed: f64,
    /// Standard deviation, m/s.
    pub deviation: f64,
    /// Direction of travel, a unit vector in the body.
    pub forward: Vector3<f64>,
    /// Contact point of the wheel, in the body, m.
    pub lever_arm: Vector3<f64>,
}

/// The non-holonomic constraint: a wheel moves neither sideways nor off the ground, so two velocity components at its contact
/// point are zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NonHolonomic {
    /// Standard deviation of the sideways velocity, m/s.
    pub lateral: f64,
    /// Standard deviation of the vertical velocity, m/s.
    pub vertical: f64,
    /// Rotates vehicle coordinates, x forward, y left, z up, to body coordinates.
    pub body_from_vehicle: UnitQuaternion<f64>,
    /// Contact point of an axle that is not steered, in the body, m.
    pub lever_arm: Vector3<f64>,
}

/// `eᵀ (Rᵀ v + ω × l)` with its derivatives with respect to velocity, rotation and gyroscope bias.
struct Along {
    speed: f64,
    velocity: Vector3<f64>,
    rotation: Vector3<f64>,
    gyroscope_bias: Vector3<f64>,
}

impl Along {
    fn new<const N: usize>(at: &Estimate<N>, axis: &Vector3<f64>, lever_arm: &Vector3<f64>) -> Self {
        let in_world = at.world_from_body * axis;
        Self {
            speed: in_world.dot(&at.velocity) + axis.dot(&at.angular_velocity.cross(lever_arm)),
            velocity: in_world,
            rotation: in_world.cross(&at.velocity),
            gyroscope_bias: axis.cross(lever_arm),
        }
    }

    fn set<const D: usize, const N: usize>(&self, row: usize, scale: f64, model: &mut Linearised<D, N>) {
        model.set_row(row, VELOCITY, &(self.velocity * scale));
        model.set_row(row, ROTATION, &(self.rotation * scale));
        model.set_row(row, GYROSCOPE_BIAS, &(self.gyroscope_bias * scale));
    }
}

impl Measurement<3> for BodyVelocity {
    fn linearise<S: States, const N: usize>(
        &self,
        at: &Estimate<N>,
        model: &mut Linearised<3, N>,
    ) -> Result<(), Refusal> {
        // In the world, the isotropic noise is unchanged.
        let rotation = at.rotation();
        let swing = rotation * at.angular_velocity.cross(&self.lever_arm);
        let measured = rotation * (self.body_from_sensor * self.velocity);
        model.set_residual(0, &(measured - at.velocity - swing));
        model.set_noise(0, &isotropic(self.deviation));
        model.set_block(0, VELOCITY, &Matrix3::identity());
        model.set_block(0, ROTATION, &skew(&(measured - swing)));
        model.set_block(0, GYROSCOPE_BIAS, &(rotation * skew(&self.lever_arm)));
        Ok(())
    }
}

impl Measurement<1> for WheelSpeed {
    fn linearise<S: States, const N: usize>(
        &self,
        at: &Estimate<N>,
        model: &mut Linearised<1, N>,
    ) -> Result<(), Refusal> {
        let along = Along::new(at, &self.forward, &self.lever_arm);
        let scale = 1.0 + at.scalar::<S>(Optional::WheelScale);
        model.residual[0] = self.speed - scale * along.speed;
        model.noise[(0, 0)] = self.deviation * self.deviation;
        along.set(0, scale, model);
        if let Some(index) = offset::<S>(Optional::WheelScale) {
            model.jacobian[0][index] = along.speed;
        }
        Ok(())
    }
}

impl Measurement<2> for NonHolonomic {
    fn linearise<S: States, const N: usize>(
        &self,
        at: &Estimate<N>,
        model: &mut Linearised<2, N>,
    ) -> Result<(), Refusal> {
        let axes = [(Vector3::y(), self.lateral), (Vector3::z(), self.vertical)];
        for (row, (axis, deviation)) in axes.into_iter().enumerate() {
            let along = Along::new(at, &(self.body_from_vehicle * axis), &self.lever_arm);
            model.residual[row] = -along.speed;
            model.noise[(row, row)] = deviation * deviation;
            along.set(row, 1.0, model);
        }
        Ok(())
    }
}
