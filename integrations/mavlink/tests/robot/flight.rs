//! The state estimator and the bridge as one chain, on virtual time: what a flight controller gets of a flight.

use crate::other::FlightController;
use bb_core::nalgebra::{Matrix3, Vector3};
use bb_core::payload::{GeodeticPosition, GnssFix, GnssServices, GnssStatus};
use bb_core::prelude::*;
use bb_estimators::StateEstimator;
use bb_estimators::navigation::state_estimator::{GpsHealth, GpsReport};
use bb_mavlink::MavlinkSender;
use mavlink::dialects::ardupilotmega::{MavMessage, MavSeverity};

robot! {
    robot Chain;

    bridges {
        bridge position: MavlinkSender(
            link = "of the test", source = "estimator/base/navigation/estimate", texts = "estimator/base/navigation/events",
            max_age = 60 s
        ) { rate: 50 Hz; }
    }
    link base {
        sensor imu: External<Imu>();
        sensor gps: External<GnssFix>();
        sensor report: External<GpsReport>();
        estimator navigation: StateEstimator(strategy = "eskf", origin_latitude = 48 deg, origin_longitude = 11 deg) {
            input imu: sensor::base::imu, driver;
            input gnss: sensor::base::gps, optional;
            input gps_health: sensor::base::report, optional;
            output estimate;
            output health;
            output events;
        }
    }
}

/// A fix at the origin.
fn fix() -> GnssFix {
    let (latitude_rad, longitude_rad) = (48_f64.to_radians(), 11_f64.to_radians());
    GnssFix {
        status: GnssStatus::Fix,
        services: GnssServices::default(),
        position: Some(GeodeticPosition { latitude_rad, longitude_rad, altitude: Some(0.0) }),
        position_covariance: Some(Matrix3::identity() * 4.0),
    }
}

/// Ten seconds at rest; the receiver is spoofed in the fifth.
#[test]
fn estimates_arrive_five_times_a_second_and_a_refused_fix_is_a_text() {
    let other = FlightController::new();
    let mut builder = Chain::builder();
    builder.options(chain::bridge::position).link = other.address.clone();
    let mut simulation = builder.simulate().expect("the link can be opened");
    let at = |millis: i64| MonotonicTime::from_nanos(millis * 1_000_000);
    for millis in (10..=10_000).step_by(10) {
        let imu = Imu::new(Vector3::zeros(), Vector3::new(0.0, 0.0, 9.80665));
        simulation.publish(chain::sensor::base::imu, at(millis), imu);
        if millis == 5_000 {
            simulation.publish(chain::sensor::base::report, at(millis), GpsReport { health: GpsHealth::Spoofed });
            simulation.publish(chain::sensor::base::gps, at(millis + 1), fix());
        }
    }
    simulation.stop().ok().expect("nothing fails");
    // Seconds of the estimates' own times, and the texts.
    let (mut times, mut texts) = (Vec::<f64>::new(), Vec::new());
    while times.last().is_none_or(|last| last - times[0] < 8.5) {
        let heard = other.hears(|_, message| match message {
            MavMessage::GPS_INPUT(data) => {
                times.push(data.time_usec as f64 * 1e-6);
                Some(())
            }
            MavMessage::STATUSTEXT(data) => {
                texts.push((data.severity, data.text.to_str().expect("it is ASCII").to_owned()));
                Some(())
            }
            _ => None,
        });
        heard.expect("the flight goes on");
    }
    let periods: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(times.len() > 40 && periods.iter().all(|period| (period - 0.2).abs() < 0.011), "{times:?}");
    let refused = (MavSeverity::MAV_SEVERITY_WARNING, "NAV GPS refused: spoofed".to_owned());
    assert!(texts.contains(&refused), "{texts:?}");
}
