//! Positions from navigation satellites.

use crate::Payload;
use nalgebra::Matrix3;

/// The position of an antenna, whose frame is the message's, from navigation satellites (`sensor_msgs/NavSatFix`).
///
/// ROS has degrees where this has radians. A conversion there and back may differ in the last bit.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
#[payload(ros)]
pub struct GnssFix {
    /// What the position is based on.
    pub status: GnssStatus,
    /// Which systems were used.
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
    pub latitude_rad: f64,
    /// Longitude, rad; positive to the east.
    pub longitude_rad: f64,
    /// Height above the ellipsoid, m, if it is known; not above the sea.
    pub altitude: Option<f64>,
}

/// What a position from satellites is based on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Payload)]
pub enum GnssStatus {
    /// The receiver does not say.
    #[default]
    Unknown,
    /// No position.
    NoFix,
    /// Satellites alone.
    Fix,
    /// With corrections from satellites (WAAS, EGNOS).
    SatelliteAugmented,
    /// With corrections from the ground (differential, RTK).
    GroundAugmented,
}

/// Systems of navigation satellites.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Payload)]
pub struct GnssServices {
    /// GPS.
    pub gps: bool,
    /// GLONASS.
    pub glonass: bool,
    /// BeiDou, once COMPASS.
    pub beidou: bool,
    /// Galileo.
    pub galileo: bool,
}
