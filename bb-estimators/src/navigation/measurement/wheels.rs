//! Velocity in the body: wheels, their kinematic constraints, and sensors that observe the ground.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::{Linearised, Measurement};
use crate::navigation::math::{rotation, skew};
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, GYROSCOPE_BIAS, Optional, ROTATION, States, VELOCITY, offset};

/// Velocity of a point of the body, in the axes of a sensor: `diag(1 + s, 1, 1) M Bᵀ (Rᵀ v + ω × l)`, with
/// [`Optional::WheelScale`] s and the rotation M by [`Optional::WheelMounting`], first the yaw and then the pitch.
///
/// Of wheels, the sensor's x axis points forward, and what they measure across and up is zero: the non-holonomic constraint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyVelocity {
    /// Velocity in the sensor's axes, m/s.
    pub velocity: Vector3<f64>,
    /// Standard deviations of its components, m/s.
    pub deviations: Vector3<f64>,
    /// Rotates sensor coordinates to body coordinates, B.
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
        let mounting = offset::<S>(Optional::WheelMounting);
        let angle = |component: usize| mounting.map_or(0.0, |first| at.optional[first + component]);
        let yaw = rotation(&Vector3::new(0.0, 0.0, angle(0))).to_rotation_matrix().into_inner();
        let pitch = rotation(&Vector3::new(0.0, angle(1), 0.0)).to_rotation_matrix().into_inner();
        let sensor_from_body = self.body_from_sensor.to_rotation_matrix().into_inner().transpose();
        let body_from_world = at.rotation().transpose();
        let in_body = body_from_world * at.velocity + at.angular_velocity.cross(&self.lever_arm);
        let turned = yaw * (sensor_from_body * in_body);
        let in_vehicle = pitch * turned;
        let scale = Vector3::new(1.0 + at.scalar::<S>(Optional::WheelScale), 1.0, 1.0);
        let scaled = Matrix3::from_diagonal(&scale);
        let from_body = scaled * pitch * yaw * sensor_from_body;
        let from_world = from_body * body_from_world;
        model.set_residual(0, &(self.velocity - scale.component_mul(&in_vehicle)));
        model.set_noise(0, &Matrix3::from_diagonal(&self.deviations.component_mul(&self.deviations)));
        model.set_block(0, VELOCITY, &from_world);
        model.set_block(0, ROTATION, &(from_world * skew(&at.velocity)));
        model.set_block(0, GYROSCOPE_BIAS, &(from_body * skew(&self.lever_arm)));
        if let Some(index) = offset::<S>(Optional::WheelScale) {
            model.jacobian[0][index] = in_vehicle.x;
        }
        if let Some(index) = mounting {
            model.set_column(0, index, &(scaled * pitch * Vector3::z().cross(&turned)));
            model.set_column(0, index + 1, &(scaled * Vector3::y().cross(&in_vehicle)));
        }
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
