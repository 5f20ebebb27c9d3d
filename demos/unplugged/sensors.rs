//! Simulated sensors of a rover that drives in a circle, which say nothing for a while.

use crate::script::{Silence, WHEELS_STALLED};
use bb_core::nalgebra::Vector3;
use bb_core::prelude::*;

/// Radius of the circle, m.
const RADIUS_M: f64 = 2.0;

/// Options of both sensors.
#[derive(Clone, Debug, Options)]
pub(crate) struct SimulatedOptions {
    /// Speed of the rover. Unit: m/s.
    #[option(required, range = 0.0..=1.5, unit = "m/s")]
    pub(crate) speed: f64,
    /// Time for which the sensor says nothing.
    #[option(required)]
    pub(crate) silence: Silence,
}

impl SimulatedOptions {
    /// Returns the measurement, or nothing while the sensor is silent.
    fn reading<T>(&self, now: MonotonicTime, measured: T) -> Reading<T> {
        if self.silence.includes(now) { Reading::nothing() } else { Reading::now(measured) }
    }
}

/// An IMU: a good one, for it has neither bias nor noise.
#[derive(Debug)]
pub(crate) struct Gyroscope(SimulatedOptions);

impl Sensor for Gyroscope {
    type Options = SimulatedOptions;
    type Output = Imu;

    fn init(options: SimulatedOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self(options))
    }

    fn read(&mut self, now: MonotonicTime) -> Result<Reading<Imu>, Fault> {
        // A rover with stalled wheels is at rest.
        let speed = if WHEELS_STALLED.includes(now) { 0.0 } else { self.0.speed };
        let angular_velocity = Vector3::new(0.0, 0.0, speed / RADIUS_M);
        let linear_acceleration = Vector3::new(0.0, speed * speed / RADIUS_M, 9.81);
        Ok(self.0.reading(now, Imu::new(angular_velocity, linear_acceleration)))
    }
}

/// Odometry of the wheels.
#[derive(Debug)]
pub(crate) struct Wheels(SimulatedOptions);

impl Sensor for Wheels {
    type Options = SimulatedOptions;
    type Output = Twist;

    fn init(options: SimulatedOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self(options))
    }

    fn read(&mut self, now: MonotonicTime) -> Result<Reading<Twist>, Fault> {
        let linear = Vector3::new(self.0.speed, 0.0, 0.0);
        let angular = Vector3::new(0.0, 0.0, self.0.speed / RADIUS_M);
        Ok(self.0.reading(now, Twist { linear, angular, covariance: None }))
    }
}
