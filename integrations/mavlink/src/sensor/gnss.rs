//! `GPS_RAW_INT`.

use super::stream::Stream;
use crate::link::Peer;
use crate::stamps::{Stamps, Unit};
use bb_core::nalgebra::{Matrix3, Vector3};
use bb_core::payload::{GeodeticPosition, GnssFix, GnssServices, GnssStatus};
use bb_core::{Fault, MonotonicTime, Options, Reading, Sensor, SensorContext};
use mavlink::MessageData;
use mavlink::dialects::ardupilotmega::{GPS_RAW_INT_DATA, GpsFixType, MavMessage};
use std::time::Duration;

/// Options of [`MavlinkGnss`].
#[derive(Clone, Debug, Options)]
pub struct MavlinkGnssOptions {
    /// Address of the flight controller: see [`Address`](crate::Address).
    #[option(required)]
    pub link: String,
    /// Height of the geoid above the ellipsoid, where the robot is: the height of a fix that gives only the one above
    /// the sea is that plus this. Not a number where it is not known: such a fix then has no height.
    #[option(default = f64::NAN, unit = "m")]
    pub geoid_height: f64,
    /// System that sends; 0 for any.
    #[option(default = 1)]
    pub system_id: u8,
    /// Component that sends; 0 for any.
    #[option(default = 1)]
    pub component_id: u8,
    /// Time for which it may send nothing that can be used.
    #[option(default = Duration::from_secs(2))]
    pub timeout: Duration,
}

/// The fixes of the flight controller's receiver.
///
/// A message without a fix is a reading without a position. The accuracies of the message (one standard deviation)
/// give the covariance; if they are zero, as in MAVLink 1, it is unknown.
#[derive(Debug)]
pub struct MavlinkGnss {
    stream: Stream,
    stamps: Stamps,
    geoid_height: Option<f64>,
}

impl Sensor for MavlinkGnss {
    type Options = MavlinkGnssOptions;
    type Output = GnssFix;

    fn init(options: MavlinkGnssOptions, context: &SensorContext) -> Result<Self, Fault> {
        let message = (GPS_RAW_INT_DATA::NAME, GPS_RAW_INT_DATA::ID);
        let peer = Peer { system_id: options.system_id, component_id: options.component_id };
        let stream = Stream::open(&options.link, peer, &[message], options.timeout, context)?;
        let geoid_height = Some(options.geoid_height).filter(|height| height.is_finite());
        Ok(Self { stream, stamps: Stamps::new(Unit::Micros, options.timeout), geoid_height })
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<GnssFix>, Fault> {
        let Some(received) = self.stream.next()? else { return Ok(Reading::nothing()) };
        let MavMessage::GPS_RAW_INT(data) = &received.message else { return Ok(Reading::nothing()) };
        let Some(fix) = fix(data, self.geoid_height) else {
            return self.stream.has_none("the position is not on the Earth").map(|()| Reading::nothing());
        };
        // Without a fix, a receiver may have no time, or repeat that of its last fix.
        let stamped = match fix.position {
            Some(_) => {
                self.stamps.time_of(data.time_usec, received.arrival).map_err(|fault| self.stream.fault(fault))?
            }
            None => Some(received.arrival),
        };
        match stamped {
            Some(time) => {
                self.stream.has_value();
                Ok(Reading::at(time, fix))
            }
            None => self.stream.has_none("stamps are repeated or out of order").map(|()| Reading::nothing()),
        }
    }
}

/// `None` if the position is not on the Earth.
fn fix(data: &GPS_RAW_INT_DATA, geoid_height: Option<f64>) -> Option<GnssFix> {
    let (status, has_height) = match data.fix_type {
        GpsFixType::GPS_FIX_TYPE_NO_GPS | GpsFixType::GPS_FIX_TYPE_NO_FIX => (GnssStatus::NoFix, false),
        GpsFixType::GPS_FIX_TYPE_2D_FIX => (GnssStatus::Fix, false),
        GpsFixType::GPS_FIX_TYPE_3D_FIX | GpsFixType::GPS_FIX_TYPE_STATIC => (GnssStatus::Fix, true),
        // MAVLink has one value for corrections from the ground and from satellites.
        GpsFixType::GPS_FIX_TYPE_DGPS | GpsFixType::GPS_FIX_TYPE_PPP => (GnssStatus::SatelliteAugmented, true),
        GpsFixType::GPS_FIX_TYPE_RTK_FLOAT | GpsFixType::GPS_FIX_TYPE_RTK_FIXED => {
            (GnssStatus::GroundAugmented, true)
        }
    };
    let services = GnssServices::default();
    if status == GnssStatus::NoFix {
        return Some(GnssFix { status, services, position: None, position_covariance: None });
    }
    let (latitude, longitude) = (degrees(data.lat), degrees(data.lon));
    if latitude.abs() > 90.0 || longitude.abs() > 180.0 {
        return None;
    }
    // Zero means that the receiver does not report it.
    let ellipsoid = Some(f64::from(data.alt_ellipsoid) * 1e-3).filter(|_| data.alt_ellipsoid != 0);
    let sea = geoid_height.map(|geoid| f64::from(data.alt) * 1e-3 + geoid);
    let position = GeodeticPosition {
        latitude_rad: latitude.to_radians(),
        longitude_rad: longitude.to_radians(),
        altitude: ellipsoid.or(sea).filter(|_| has_height),
    };
    let variance = |millimetres: u32| (f64::from(millimetres) * 1e-3).powi(2);
    let (horizontal, vertical) = (variance(data.h_acc), variance(data.v_acc));
    let is_known = horizontal > 0.0 && vertical > 0.0;
    let position_covariance =
        is_known.then(|| Matrix3::from_diagonal(&Vector3::new(horizontal, horizontal, vertical)));
    Some(GnssFix { status, services, position: Some(position), position_covariance })
}

fn degrees(tenths_of_microdegrees: i32) -> f64 {
    f64::from(tenths_of_microdegrees) * 1e-7
}

#[cfg(test)]
mod tests {
    use super::*;
    use bb_tests::laws;
    use proptest::prelude::*;

    fn data(fix_type: GpsFixType) -> GPS_RAW_INT_DATA {
        GPS_RAW_INT_DATA {
            fix_type,
            lat: 481_234_567,
            lon: -1_100_000_000,
            alt: 500_250,
            alt_ellipsoid: 547_500,
            h_acc: 1_500,
            v_acc: 3_000,
            eph: u16::MAX,
            ..Default::default()
        }
    }

    fn position(data: &GPS_RAW_INT_DATA, geoid: Option<f64>) -> GeodeticPosition {
        fix(data, geoid).and_then(|fix| fix.position).expect("it has one")
    }

    #[test]
    fn a_fix_has_position_and_covariance() {
        let fix = fix(&data(GpsFixType::GPS_FIX_TYPE_3D_FIX), None).expect("it is on the Earth");
        let position = fix.position.expect("it has one");
        assert!((position.latitude_rad.to_degrees() - 48.1234567).abs() < 1e-12);
        assert!((position.longitude_rad.to_degrees() + 110.0).abs() < 1e-12);
        assert_eq!((position.altitude, fix.status), (Some(547.5), GnssStatus::Fix));
        let covariance = fix.position_covariance.expect("it is known");
        assert_eq!(covariance, Matrix3::from_diagonal(&Vector3::new(2.25, 2.25, 9.0)));
    }

    #[test]
    fn what_the_receiver_does_not_say_is_unknown() {
        let old = GPS_RAW_INT_DATA { alt_ellipsoid: 0, h_acc: 0, ..data(GpsFixType::GPS_FIX_TYPE_3D_FIX) };
        assert_eq!(position(&old, None).altitude, None);
        assert_eq!(position(&old, Some(47.25)).altitude, Some(547.5));
        assert_eq!(fix(&old, None).and_then(|fix| fix.position_covariance), None);
        let flat = data(GpsFixType::GPS_FIX_TYPE_2D_FIX);
        assert_eq!(position(&flat, Some(47.25)).altitude, None, "a fix in two dimensions has no height");
        for none in [GpsFixType::GPS_FIX_TYPE_NO_GPS, GpsFixType::GPS_FIX_TYPE_NO_FIX] {
            let fix = fix(&data(none), None).expect("it says that there is none");
            assert_eq!((fix.position, fix.status), (None, GnssStatus::NoFix));
        }
    }

    #[test]
    fn a_position_beyond_the_limits_is_none() {
        let with = |lat, lon| GPS_RAW_INT_DATA { lat, lon, ..data(GpsFixType::GPS_FIX_TYPE_RTK_FIXED) };
        for (lat, lon) in [(900_000_000, 1_800_000_000), (-900_000_000, -1_800_000_000)] {
            assert!(fix(&with(lat, lon), None).is_some(), "{lat} {lon}");
        }
        for (lat, lon) in [(900_000_001, 0), (0, 1_800_000_001), (i32::MIN, 0), (0, i32::MAX)] {
            assert_eq!(fix(&with(lat, lon), None), None, "{lat} {lon}");
        }
    }

    laws! {
        #[test]
        fn every_value_is_finite_or_unknown(
            (lat, lon, alt, alt_ellipsoid) in any::<(i32, i32, i32, i32)>(),
            (h_acc, v_acc) in any::<(u32, u32)>(),
        ) {
            let data = GPS_RAW_INT_DATA { lat, lon, alt, alt_ellipsoid, h_acc, v_acc, ..data(GpsFixType::GPS_FIX_TYPE_DGPS) };
            if let Some(fix) = fix(&data, Some(40.0)) {
                let position = fix.position.expect("it has a fix");
                prop_assert!(position.latitude_rad.abs() <= std::f64::consts::FRAC_PI_2);
                prop_assert!(position.longitude_rad.abs() <= std::f64::consts::PI);
                prop_assert!(position.altitude.is_some_and(f64::is_finite));
                prop_assert!(fix.position_covariance.is_none_or(|covariance| covariance.determinant() > 0.0));
            }
        }
    }
}
