//! Distances: of one beam, and of many in a plane.

use crate::message::Payload;
use std::sync::Arc;

/// The distance to the nearest object in a cone in front of a sensor, along x of the message's frame (`sensor_msgs/Range`).
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
#[payload(ros)]
pub struct Range {
    /// The kind of radiation.
    pub radiation: Radiation,
    /// The full angle of the cone, rad.
    #[payload(unit = "rad")]
    pub field_of_view: f32,
    /// The smallest measurable distance, m.
    #[payload(unit = "m")]
    pub min_range: f32,
    /// The largest measurable distance, m.
    #[payload(unit = "m")]
    pub max_range: f32,
    /// Distance, m. A sensor that only detects presence reports −∞ for an object and +∞ for none (REP 117).
    #[payload(non_finite, unit = "m")]
    pub range: f32,
    /// Variance of the distance, m².
    #[payload(unit = "m^2")]
    pub variance: Option<f32>,
}

/// The radiation of a [`Range`] sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Payload)]
pub enum Radiation {
    /// Sound.
    #[default]
    Ultrasound,
    /// Light.
    Infrared,
}

/// Distances in a plane, x and y of the message's frame (`sensor_msgs/LaserScan`). The message's time is that of the first
/// beam.
#[derive(Clone, Debug, PartialEq, Payload)]
#[payload(ros)]
pub struct LaserScan {
    /// Angle of the first beam, rad: from x, positive to y.
    #[payload(unit = "rad")]
    pub angle_min: f32,
    /// Angle of the last beam, rad.
    #[payload(unit = "rad")]
    pub angle_max: f32,
    /// Angle from beam to beam, rad; negative clockwise.
    #[payload(unit = "rad")]
    pub angle_increment: f32,
    /// Time from beam to beam, s.
    #[payload(unit = "s")]
    pub time_increment: f32,
    /// Time from scan to scan, s.
    #[payload(unit = "s")]
    pub scan_time: f32,
    /// The smallest measurable distance, m.
    #[payload(unit = "m")]
    pub range_min: f32,
    /// The largest measurable distance, m.
    #[payload(unit = "m")]
    pub range_max: f32,
    /// Distances, m: −∞ if too near, +∞ if nothing was hit, NaN if the measurement failed (REP 117).
    #[payload(non_finite)]
    pub ranges: Arc<[f32]>,
    /// Strength of the return in units of the device; empty if it is not measured.
    #[payload(non_finite)]
    pub intensities: Arc<[f32]>,
}
