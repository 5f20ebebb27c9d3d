//! `GPS_INPUT`: the estimate as that of a satellite receiver.

use crate::axes::swap_world;
use bb_core::nalgebra::Vector3;
use bb_core::time::WallTime;
use bb_estimators::navigation::state_estimator::FlightEstimate;
use mavlink::dialects::ardupilotmega::{GPS_INPUT_DATA, GpsFixType, GpsInputIgnoreFlags};

/// Values that the estimate does not contain.
#[derive(Clone, Debug)]
pub(super) struct GpsInput {
    pub(super) geoid_height: Option<f64>,
    pub(super) no_fix_beyond: f64,
    pub(super) gps_id: u8,
    pub(super) satellites: u8,
    pub(super) hdop: Option<f64>,
    pub(super) sends_yaw: bool,
    pub(super) leap_seconds: i32,
}

impl GpsInput {
    /// `None` if a value is not finite, or the position is not on the Earth.
    pub(super) fn message(&self, estimate: &FlightEstimate, wall: WallTime) -> Option<GPS_INPUT_DATA> {
        use GpsInputIgnoreFlags as Flags;
        let position = &estimate.position;
        let height = position.altitude?;
        let (horizontal, vertical) = accuracies(estimate)?;
        let velocity = swap_world(&estimate.velocity);
        let velocity = velocity.cast::<f32>();
        let altitude = self.geoid_height.map_or(0.0, |geoid| height - geoid) as f32;
        let sent = [altitude, height as f32, horizontal as f32, vertical as f32];
        let is_finite = sent.iter().chain(velocity.iter()).all(|value| value.is_finite());
        // The covariance does not include the velocity.
        let mut ignore_flags = Flags::GPS_INPUT_IGNORE_FLAG_SPEED_ACCURACY | Flags::GPS_INPUT_IGNORE_FLAG_VDOP;
        ignore_flags.set(Flags::GPS_INPUT_IGNORE_FLAG_ALT, self.geoid_height.is_none());
        ignore_flags.set(Flags::GPS_INPUT_IGNORE_FLAG_VERTICAL_ACCURACY, self.geoid_height.is_none());
        ignore_flags.set(Flags::GPS_INPUT_IGNORE_FLAG_HDOP, self.hdop.is_none());
        let (time_week, time_week_ms) = self.gps_time(wall);
        let has_fix = horizontal <= self.no_fix_beyond;
        is_finite.then_some(())?;
        Some(GPS_INPUT_DATA {
            time_usec: u64::try_from(wall.as_unix_nanos() / 1_000).unwrap_or(0),
            time_week_ms,
            lat: degrees(position.latitude_rad, 90.0)?,
            lon: degrees(position.longitude_rad, 180.0)?,
            alt: altitude,
            hdop: self.hdop.unwrap_or(0.0) as f32,
            vdop: 0.0,
            vn: velocity.x,
            ve: velocity.y,
            vd: velocity.z,
            speed_accuracy: 0.0,
            horiz_accuracy: horizontal as f32,
            vert_accuracy: vertical as f32,
            ignore_flags,
            time_week,
            gps_id: self.gps_id,
            fix_type: match self.geoid_height {
                _ if !has_fix => GpsFixType::GPS_FIX_TYPE_NO_FIX,
                // Without a height above the sea.
                None => GpsFixType::GPS_FIX_TYPE_2D_FIX,
                Some(_) => GpsFixType::GPS_FIX_TYPE_3D_FIX,
            },
            satellites_visible: self.satellites,
            yaw: if self.sends_yaw { yaw(estimate) } else { 0 },
        })
    }

    /// Week, and milliseconds in it; both 0 before the first week.
    fn gps_time(&self, wall: WallTime) -> (u16, u32) {
        /// Time from 1970 to 6 January 1980, ms.
        const EPOCH_MS: i64 = 315_964_800_000;
        const WEEK_MS: i64 = 7 * 24 * 3_600 * 1_000;
        let since = wall.as_unix_nanos() / 1_000_000 - EPOCH_MS + i64::from(self.leap_seconds) * 1_000;
        let week = u16::try_from(since.div_euclid(WEEK_MS));
        let in_week = u32::try_from(since.rem_euclid(WEEK_MS));
        week.ok().zip(in_week.ok()).unwrap_or((0, 0))
    }
}

/// Converts an angle to tenths of microdegrees; `None` beyond the limit, degrees.
fn degrees(radians: f64, limit: f64) -> Option<i32> {
    let degrees = radians.to_degrees();
    // NaN is out of range as well.
    (degrees.abs() <= limit).then(|| (degrees * 1e7).round() as i32)
}

/// Standard deviations: horizontally in the worst direction, and of the height; m.
fn accuracies(estimate: &FlightEstimate) -> Option<(f64, f64)> {
    let covariance = &estimate.covariance;
    let (east, north, both) = (covariance[(0, 0)], covariance[(1, 1)], covariance[(0, 1)]);
    let largest = 0.5 * (east + north) + (0.25 * (east - north).powi(2) + both * both).sqrt();
    let (horizontal, vertical) = (largest.sqrt(), covariance[(2, 2)].sqrt());
    (horizontal.is_finite() && vertical.is_finite()).then_some((horizontal, vertical))
}

/// Clockwise from north, in hundredths of degrees: north is 36000, since 0 is unknown.
fn yaw(estimate: &FlightEstimate) -> u16 {
    let forward = estimate.world_from_body * Vector3::x();
    let centidegrees = (forward.x.atan2(forward.y).to_degrees() * 100.0).round().rem_euclid(36_000.0) as u16;
    if centidegrees == 0 { 36_000 } else { centidegrees }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use bb_core::MonotonicTime;
    use bb_core::nalgebra::{Matrix6, UnitQuaternion, Vector6};
    use bb_core::payload::GeodeticPosition;
    use bb_estimators::navigation::state_estimator::SourceLabel;
    use bb_tests::laws;
    use proptest::prelude::*;

    /// Returns an estimate in Munich, to the north-west, 5 m and 2 m to east and north, 3 m up.
    pub(in crate::sender) fn estimate() -> FlightEstimate {
        FlightEstimate {
            frame_id: [7; 16],
            emitted: MonotonicTime::ZERO,
            time: MonotonicTime::ZERO,
            position: GeodeticPosition {
                latitude_rad: 48.1_f64.to_radians(),
                longitude_rad: 11.5_f64.to_radians(),
                altitude: Some(547.5),
            },
            world_from_body: UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 135_f64.to_radians()),
            velocity: Vector3::new(-1.0, 2.0, 0.5),
            covariance: Matrix6::from_diagonal(&Vector6::new(25.0, 4.0, 9.0, 1e-4, 4e-4, 9e-4)),
            label: SourceLabel::VisualPropagated,
            anchor_age_ms: Some(100),
            smoothed: false,
            degraded: false,
            resets: 0,
            covariance_norm: 27.0,
            nis: None,
            is_anchor_degraded: false,
        }
    }

    fn settings() -> GpsInput {
        GpsInput {
            geoid_height: Some(47.25),
            no_fix_beyond: 100.0,
            gps_id: 1,
            satellites: 10,
            hdop: None,
            sends_yaw: true,
            leap_seconds: 18,
        }
    }

    #[test]
    fn all_fields_are_those_of_the_estimate() {
        use GpsInputIgnoreFlags as Flags;
        // 22 November 2026, 00:00:00 UTC, a Sunday: the first second of week 2446 was 18 s before.
        let wall = WallTime::from_unix_nanos(1_795_305_600_000_000_000);
        let message = settings().message(&estimate(), wall).expect("it can be sent");
        assert_eq!((message.lat, message.lon, message.alt), (481_000_000, 115_000_000, 500.25));
        assert_eq!([message.vn, message.ve, message.vd], [2.0, -1.0, -0.5]);
        assert_eq!((message.horiz_accuracy, message.vert_accuracy), (5.0, 3.0));
        assert_eq!(
            (message.time_usec, message.time_week, message.time_week_ms),
            (1_795_305_600_000_000, 2446, 18_000)
        );
        assert_eq!((message.gps_id, message.satellites_visible, message.yaw), (1, 10, 31_500));
        assert_eq!(message.fix_type, GpsFixType::GPS_FIX_TYPE_3D_FIX);
        let ignored = Flags::GPS_INPUT_IGNORE_FLAG_SPEED_ACCURACY
            | Flags::GPS_INPUT_IGNORE_FLAG_VDOP
            | Flags::GPS_INPUT_IGNORE_FLAG_HDOP;
        assert_eq!(message.ignore_flags, ignored);
    }

    #[test]
    fn what_is_not_known_is_marked_to_be_ignored() {
        use GpsInputIgnoreFlags as Flags;
        let unknown = GpsInput { geoid_height: None, hdop: Some(0.75), sends_yaw: false, ..settings() };
        let message = unknown.message(&estimate(), WallTime::from_unix_nanos(0)).expect("it can be sent");
        assert!(message.ignore_flags.contains(Flags::GPS_INPUT_IGNORE_FLAG_ALT));
        assert!(!message.ignore_flags.contains(Flags::GPS_INPUT_IGNORE_FLAG_HDOP));
        assert_eq!((message.alt, message.hdop, message.yaw), (0.0, 0.75, 0));
        assert_eq!(
            (message.time_week, message.time_week_ms, message.time_usec),
            (0, 0, 0),
            "before the first week"
        );
    }

    #[test]
    fn an_estimate_that_is_too_uncertain_is_no_fix() {
        let vague = |deviation: f64| {
            let mut estimate = estimate();
            estimate.covariance[(0, 0)] = deviation * deviation;
            settings().message(&estimate, WallTime::from_unix_nanos(0)).map(|message| message.fix_type)
        };
        assert_eq!(vague(100.0), Some(GpsFixType::GPS_FIX_TYPE_3D_FIX));
        assert_eq!(vague(100.1), Some(GpsFixType::GPS_FIX_TYPE_NO_FIX));
        assert_eq!(vague(f64::INFINITY), None);
    }

    #[test]
    fn the_horizontal_accuracy_is_that_of_the_worst_direction() {
        let mut estimate = estimate();
        // An ellipse of 5 m and 3 m, turned by 45 degrees.
        let turned = [[17.0, 8.0], [8.0, 17.0]];
        (0..4).for_each(|at| estimate.covariance[(at / 2, at % 2)] = turned[at / 2][at % 2]);
        assert_eq!(accuracies(&estimate), Some((5.0, 3.0)));
    }

    laws! {
        #[test]
        fn what_is_sent_is_finite(
            values in proptest::collection::vec(proptest::num::f64::ANY, 12),
            nanos in any::<i64>(),
        ) {
            let mut estimate = estimate();
            (estimate.position.latitude_rad, estimate.position.longitude_rad) = (values[0], values[1]);
            estimate.position.altitude = Some(values[2]);
            estimate.velocity = Vector3::new(values[3], values[4], values[5]);
            (0..6).for_each(|at| estimate.covariance[(at / 3, at % 3)] = values[6 + at]);
            if let Some(message) = settings().message(&estimate, WallTime::from_unix_nanos(nanos)) {
                prop_assert!(message.lat.abs() <= 900_000_000 && message.lon.abs() <= 1_800_000_000);
                prop_assert!(message.time_week_ms < 604_800_000 && message.horiz_accuracy >= 0.0);
                prop_assert!(!message.alt.is_nan() && !message.vn.is_nan());
            }
        }

        #[test]
        fn yaw_is_clockwise_from_north_and_never_zero(degrees in 0.0..360.0_f64) {
            let mut estimate = estimate();
            estimate.world_from_body = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), (90.0 - degrees).to_radians());
            let yaw = f64::from(yaw(&estimate));
            prop_assert!((1.0..=36_000.0).contains(&yaw));
            let error = (yaw / 100.0 - degrees).rem_euclid(360.0);
            prop_assert!(error.min(360.0 - error) <= 0.005_000_1);
        }
    }
}
