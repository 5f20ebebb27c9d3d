//! Options of the bridge.

use super::gps_input::GpsInput;
use super::kind::Kind;
use super::odometry::OdometryFrame;
use bb_core::{Fault, Options};
use bb_estimators::navigation::{Geodetic, LocalFrame};
use mavlink::dialects::ardupilotmega::MavFrame;
use std::time::Duration;

/// Options of [`MavlinkSender`](super::MavlinkSender).
#[derive(Clone, Debug, Options)]
pub struct MavlinkSenderOptions {
    /// Address of the flight controller: see [`Address`](crate::Address).
    #[option(required)]
    pub link: String,
    /// Path of the estimate, such as `estimator/base/navigation/estimate`.
    #[option(required)]
    pub source: String,
    /// `gps_input` or `odometry`.
    #[option(default = "gps_input")]
    pub message: String,
    /// Path of the events whose status texts are sent, such as `estimator/base/navigation/events`; empty for none.
    #[option(default = "")]
    pub texts: String,
    /// System as which it speaks: that of the vehicle.
    #[option(default = 1)]
    pub system_id: u8,
    /// Component as which it speaks: 191 is the onboard computer, 197 visual-inertial odometry.
    #[option(default = 191)]
    pub component_id: u8,
    /// An estimate that is older is not sent.
    #[option(default = Duration::from_millis(500))]
    pub max_age: Duration,
    /// Set of sources (1 to 3) that ArduPilot's filter is to use while there are estimates; 0 leaves it alone.
    #[option(default = 0, range = 0..=3)]
    pub source_set: u8,
    /// Set of sources while the estimator's fallback is engaged, of which the events of `texts` tell.
    #[option(default = 1, range = 1..=3)]
    pub fallback_source_set: u8,
    /// `GPS_INPUT`: height of the geoid above the ellipsoid, where the robot is. Not a number where it is not known:
    /// the height is then marked to be ignored, since MAVLink wants the one above the sea.
    #[option(default = f64::NAN, unit = "m")]
    pub geoid_height: f64,
    /// `GPS_INPUT`: with a larger horizontal standard deviation, it says that there is no fix.
    #[option(default = 100.0, range = 0.1..=1e6, unit = "m")]
    pub no_fix_beyond: f64,
    /// `GPS_INPUT`: number of the receiver, as the flight controller counts them.
    #[option(default = 0)]
    pub gps_id: u8,
    /// `GPS_INPUT`: how many satellites it claims; flight controllers refuse a receiver with few.
    #[option(default = 10)]
    pub satellites: u8,
    /// `GPS_INPUT`: the dilution of precision that it claims; not a number to have it ignored. ArduPilot does not use a receiver
    /// whose dilution is unknown or above 2.5.
    #[option(default = 1.0)]
    pub hdop: f64,
    /// `GPS_INPUT`: whether the heading is sent, too.
    #[option(default = false)]
    pub send_yaw: bool,
    /// `GPS_INPUT`: GPS time less UTC, s. It was 18 from 2017 to at least 2026.
    #[option(default = 18)]
    pub leap_seconds: i32,
    /// `ODOMETRY`: what its frame is called, `local_ned` or `local_frd`. ArduPilot takes only `local_frd`; the numbers are the
    /// same, with forward to the north.
    #[option(default = "local_ned")]
    pub frame: String,
    /// `ODOMETRY` of a flight estimate: origin of the local frame. Not a number for the position of the first estimate sent that
    /// is not degraded.
    #[option(default = f64::NAN, unit = "rad")]
    pub origin_latitude: f64,
    /// Longitude of the origin.
    #[option(default = 0.0, unit = "rad")]
    pub origin_longitude: f64,
    /// Height of the origin above the ellipsoid.
    #[option(default = 0.0, unit = "m")]
    pub origin_height: f64,
}

impl MavlinkSenderOptions {
    pub(super) fn kind(&self) -> Result<Kind, Fault> {
        // 0 is the broadcast address.
        if self.system_id == 0 || self.component_id == 0 {
            let (system, component) = (self.system_id, self.component_id);
            return Err(Fault::permanent(format!(
                "it cannot speak as system {system}, component {component}: both ids are from 1 to 255"
            )));
        }
        if self.source_set > 0 && self.texts.is_empty() {
            return Err(Fault::permanent(
                "source_set is given, but no events that tell of the fallback: name them in `texts`",
            ));
        }
        match self.message.as_str() {
            "gps_input" => Ok(Kind::GpsInput(GpsInput {
                geoid_height: Some(self.geoid_height).filter(|height| height.is_finite()),
                no_fix_beyond: self.no_fix_beyond,
                gps_id: self.gps_id,
                satellites: self.satellites,
                hdop: Some(self.hdop).filter(|hdop| hdop.is_finite()),
                sends_yaw: self.send_yaw,
                leap_seconds: self.leap_seconds,
            })),
            "odometry" => {
                let (latitude, longitude) = (self.origin_latitude, self.origin_longitude);
                let origin = Geodetic { latitude, longitude, height: self.origin_height };
                let origin = (!latitude.is_nan()).then(|| LocalFrame::new(origin));
                Ok(Kind::Odometry(OdometryFrame::new(origin, self.mav_frame()?)))
            }
            other => Err(Fault::permanent(format!("message is `{other}`: write `gps_input` or `odometry`"))),
        }
    }

    fn mav_frame(&self) -> Result<MavFrame, Fault> {
        match self.frame.as_str() {
            "local_ned" => Ok(MavFrame::MAV_FRAME_LOCAL_NED),
            "local_frd" => Ok(MavFrame::MAV_FRAME_LOCAL_FRD),
            other => Err(Fault::permanent(format!("frame is `{other}`: write `local_ned` or `local_frd`"))),
        }
    }
}
