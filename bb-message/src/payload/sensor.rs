//! Measurements of inertial, magnetic and pressure sensors.

use crate::message::Payload;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// One sample of an inertial measurement unit, in the frame of its sensor (`sensor_msgs/Imu`).
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
#[payload(ros)]
pub struct Imu {
    /// Angular velocity, rad/s.
    #[payload(unit = "rad/s")]
    pub angular_velocity: Vector3<f64>,
    /// Specific force, m/s²: the measurement of an accelerometer; at rest +9.81 along the axis that points up.
    #[payload(unit = "m/s^2")]
    pub linear_acceleration: Vector3<f64>,
    /// The device's own orientation, `world_from_body`, if it has one.
    pub orientation: Option<UnitQuaternion<f64>>,
    /// Covariance of the orientation, rad².
    pub orientation_covariance: Option<Matrix3<f64>>,
    /// Covariance of the angular velocity, rad²/s².
    pub angular_velocity_covariance: Option<Matrix3<f64>>,
    /// Covariance of the linear acceleration, m²/s⁴.
    pub linear_acceleration_covariance: Option<Matrix3<f64>>,
}

impl Imu {
    /// A sample from its angular velocity (rad/s) and specific force (m/s²), all else unknown.
    pub fn new(angular_velocity: Vector3<f64>, linear_acceleration: Vector3<f64>) -> Self {
        Self {
            angular_velocity,
            linear_acceleration,
            orientation: None,
            orientation_covariance: None,
            angular_velocity_covariance: None,
            linear_acceleration_covariance: None,
        }
    }
}

/// The magnetic field, in the frame of its sensor (`sensor_msgs/MagneticField`).
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
#[payload(ros)]
pub struct MagneticField {
    /// The field, tesla.
    #[payload(unit = "T")]
    pub magnetic_field: Vector3<f64>,
    /// Covariance of the field, T².
    pub covariance: Option<Matrix3<f64>>,
}

impl MagneticField {
    /// A sample of the field (tesla), its covariance unknown.
    pub fn new(magnetic_field: Vector3<f64>) -> Self {
        Self { magnetic_field, covariance: None }
    }
}

/// One sample of a sensor with gyroscope, accelerometer and magnetometer in one housing: magnetic, angular rate,
/// gravity (`sensor_msgs/Imu`, and `sensor_msgs/MagneticField` if there is a reading).
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
#[payload(ros)]
pub struct Marg {
    /// The inertial sample.
    pub imu: Imu,
    /// The magnetic field, if there is a reading for this sample.
    pub magnetic_field: Option<MagneticField>,
}

/// The pressure of a gas or a liquid around a sensor: of a barometer, or under water (`sensor_msgs/FluidPressure`).
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
#[payload(ros)]
pub struct FluidPressure {
    /// Absolute pressure, Pa.
    #[payload(unit = "Pa")]
    pub fluid_pressure: f64,
    /// Variance of the pressure, Pa².
    #[payload(unit = "Pa^2")]
    pub variance: Option<f64>,
}
