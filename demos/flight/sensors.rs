//! Measurements of the drone's sensors, and their faults.

use crate::trajectory::{GRAVITY, motion};
use bb_core::nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector3};
use bb_core::payload::{GeodeticPosition, GnssFix, GnssServices, GnssStatus, Imu};
use bb_core::prelude::*;
use bb_estimators::navigation::state_estimator::{AnchorReading, GpsHealth, GpsReport, RelativePoseReading};
use bb_estimators::navigation::{Geodetic, LocalFrame};

/// All times in ms.
pub(crate) const STEP: i64 = 5;
pub(crate) const FRAME: i64 = 100;
pub(crate) const FIX: i64 = 200;
pub(crate) const END: i64 = 90_000;

/// Time for which the receiver is spoofed; after it, it is healthy again.
pub(crate) const SPOOFED: std::ops::Range<i64> = 20_000..60_000;
/// Time for which the drone is in fog.
pub(crate) const FOG: std::ops::Range<i64> = 40_000..50_000;

pub(crate) fn frame() -> LocalFrame {
    LocalFrame::new(Geodetic::from_degrees(48.0, 11.0, 500.0))
}

pub(crate) fn at(millis: i64) -> MonotonicTime {
    MonotonicTime::from_nanos(millis * 1_000_000)
}

fn seconds(millis: i64) -> f64 {
    millis as f64 * 1e-3
}

/// Noise that is the same in every run, of unit variance.
struct Noise(u64);

impl Noise {
    fn vector(&mut self, deviation: f64) -> Vector3<f64> {
        let mut uniform = || {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1_u64 << 53) as f64
        };
        Vector3::from_fn(|_, _| ((0..12).map(|_| uniform()).sum::<f64>() - 6.0) * deviation)
    }
}

/// All sensors.
pub(crate) struct Sensors {
    noise: Noise,
    gyroscope_bias: Vector3<f64>,
    accelerometer_bias: Vector3<f64>,
    frame: LocalFrame,
}

impl Sensors {
    pub(crate) fn new() -> Self {
        let mut noise = Noise(12);
        let (gyroscope_bias, accelerometer_bias) = (noise.vector(0.005), noise.vector(0.05));
        Self { noise, gyroscope_bias, accelerometer_bias, frame: frame() }
    }

    /// The mean over the step that ends at a time.
    pub(crate) fn imu(&mut self, millis: i64) -> Imu {
        let (from, to) = (seconds(millis - STEP), seconds(millis));
        let dt = to - from;
        let turn = motion(from).world_from_body.inverse() * motion(to).world_from_body;
        let middle = motion(0.5 * (from + to));
        let force = middle.world_from_body.inverse() * (middle.acceleration + Vector3::new(0.0, 0.0, GRAVITY));
        let white = 1.0 / dt.sqrt();
        let angular_velocity = turn.scaled_axis() / dt + self.gyroscope_bias + self.noise.vector(1.7e-4 * white);
        Imu::new(angular_velocity, force + self.accelerometer_bias + self.noise.vector(2e-3 * white))
    }

    /// The frame that was taken at a time, relative to the one before; none in fog.
    pub(crate) fn vio(&mut self, millis: i64) -> Option<RelativePoseReading> {
        let from_millis = millis - FRAME;
        if FOG.contains(&millis) || FOG.contains(&from_millis) {
            return None;
        }
        let (from, to) = (motion(seconds(from_millis)), motion(seconds(millis)));
        let way = from.world_from_body.inverse() * (to.position - from.position);
        let turn = from.world_from_body.inverse() * to.world_from_body;
        Some(RelativePoseReading {
            from: at(from_millis),
            translation: way + self.noise.vector(0.02),
            from_to: turn * UnitQuaternion::from_scaled_axis(self.noise.vector(1e-3)),
            covariance: diagonal(0.02, 1e-3),
            accelerometer_bias: None,
            gyroscope_bias: None,
        })
    }

    /// The pose from a satellite image: one every second near the start, then every eight, later every four.
    pub(crate) fn anchor(&mut self, millis: i64) -> Option<AnchorReading> {
        let every = match millis {
            ..10_000 => return None,
            10_000..20_000 => 1_000,
            20_000..50_000 => 8_000,
            _ => 4_000,
        };
        if FOG.contains(&millis) || millis % every != 0 {
            return None;
        }
        let truth = motion(seconds(millis));
        let position = self.frame.geodetic(&(truth.position + self.noise.vector(1.5)));
        let turn = self.frame.other_from_self(&LocalFrame::new(position)).rotation;
        let wrong = UnitQuaternion::from_scaled_axis(self.noise.vector(0.02));
        Some(AnchorReading {
            provider: 0,
            position: geodetic(&position),
            world_from_body: turn * wrong * truth.world_from_body,
            covariance: diagonal(1.5, 0.02),
            is_covariance_degraded: false,
        })
    }

    /// The fix at a time; one that is spoofed is led away.
    pub(crate) fn fix(&mut self, millis: i64) -> GnssFix {
        let led =
            if SPOOFED.contains(&millis) { 0.02 * seconds(millis - SPOOFED.start).powi(2) * 10.0 } else { 0.0 };
        let position = motion(seconds(millis)).position + self.noise.vector(2.0) + Vector3::y() * led;
        GnssFix {
            status: GnssStatus::Fix,
            services: GnssServices::default(),
            position: Some(geodetic(&self.frame.geodetic(&position))),
            position_covariance: Some(Matrix3::identity() * 4.0),
        }
    }

    /// Returns the flight controller's report on its receiver.
    pub(crate) fn report(millis: i64) -> GpsReport {
        GpsReport { health: if SPOOFED.contains(&millis) { GpsHealth::Spoofed } else { GpsHealth::Stable } }
    }
}

fn geodetic(position: &Geodetic) -> GeodeticPosition {
    let Geodetic { latitude, longitude, height } = *position;
    GeodeticPosition { latitude_rad: latitude, longitude_rad: longitude, altitude: Some(height) }
}

fn diagonal(first: f64, second: f64) -> Matrix6<f64> {
    Matrix6::from_fn(|i, j| if i == j { (if i < 3 { first } else { second }).powi(2) } else { 0.0 })
}
