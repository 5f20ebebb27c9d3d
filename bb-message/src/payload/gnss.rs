//! Satellite navigation.

use crate::message::Payload;
use nalgebra::Matrix3;

/// The position of an antenna, whose frame is the message's, from satellite navigation (`sensor_msgs/NavSatFix`).
///
/// ROS uses degrees and this payload radians. A conversion there and back may differ in the last bit.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
#[payload(ros)]
pub struct GnssFix {
    /// Basis of the position.
    pub status: GnssStatus,
    /// Satellite systems that were used.
    pub services: GnssServices,
    /// The position, if the receiver has one.
    pub position: Option<GeodeticPosition>,
    /// Covariance of the position in east, north and up at the position, m².
    pub position_covariance: Option<Matrix3<f64>>,
}

/// A position on the Earth, WGS 84.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub struct GeodeticPosition {
    /// Latitude, rad; positive to the north.
    #[payload(unit = "rad")]
    pub latitude_rad: f64,
    /// Longitude, rad; positive to the east.
    #[payload(unit = "rad")]
    pub longitude_rad: f64,
    /// Height above the ellipsoid (not above sea level), m, if known.
    #[payload(unit = "m")]
    pub altitude: Option<f64>,
}

/// The basis of a satellite position.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Payload)]
pub enum GnssStatus {
    /// The receiver does not say.
    #[default]
    Unknown,
    /// No position.
    NoFix,
    /// Satellites alone.
    Fix,
    /// Corrections from satellites (WAAS, EGNOS).
    SatelliteAugmented,
    /// Corrections from the ground (differential, RTK).
    GroundAugmented,
}

/// Satellite navigation systems.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Payload)]
pub struct GnssServices {
    /// GPS.
    pub gps: bool,
    /// GLONASS.
    pub glonass: bool,
    /// BeiDou, formerly COMPASS.
    pub beidou: bool,
    /// Galileo.
    pub galileo: bool,
}
