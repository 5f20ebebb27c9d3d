//! Messages that the drivers publish.

use super::{Drone, LONG, drone};
use crate::other::FlightController;
use bb_core::nalgebra::Vector3;
use bb_core::prelude::*;
use bb_estimators::navigation::state_estimator::GpsHealth;
use std::sync::atomic::Ordering;

#[test]
fn all_sensors_of_one_link_publish_in_the_axes_of_the_framework() {
    let other = FlightController::new();
    let builder = drone(&other.address);
    let imu = builder.subscribe(drone::sensor::base::imu);
    let other_imu = builder.subscribe(drone::sensor::base::other_imu);
    let attitude = builder.subscribe(drone::sensor::base::attitude);
    let gps = builder.subscribe(drone::sensor::base::gps);
    let gps_health = builder.subscribe(drone::sensor::base::gps_health);
    let heartbeats = builder.subscribe(drone::sensor::base::heartbeat);
    let running: Running<Drone> = builder.start().expect("the link can be opened");

    let sample = imu.recv_timeout(LONG).expect("it comes");
    assert_eq!(sample.linear_acceleration, Vector3::new(0.5, -0.25, 9.75));
    assert_eq!(sample.angular_velocity, Vector3::new(0.125, -0.0625, -0.5));
    let next = imu.recv_timeout(LONG).expect("it comes");
    assert!(next.monotonic_time > sample.monotonic_time);
    assert!(next.monotonic_time <= Clock::real().now(), "no stamp is in the future");

    let sample = other_imu.recv_timeout(LONG).expect("it comes");
    assert!((sample.linear_acceleration - Vector3::new(0.0, 0.0, 9.80665)).norm() < 1e-12);
    assert!((sample.angular_velocity - Vector3::new(0.25, 0.0, 0.0)).norm() < 1e-12);

    let orientation = attitude.recv_timeout(LONG).expect("it comes");
    assert!(orientation.world_from_body.angle() < 1e-6, "level, to the east");

    let fix = gps.recv_timeout(LONG).expect("it comes");
    let position = fix.position.expect("it has one");
    assert!((position.latitude_rad.to_degrees() - 48.1).abs() < 1e-9);
    assert!((position.longitude_rad.to_degrees() - 11.5).abs() < 1e-9);
    assert_eq!((position.altitude, fix.position_covariance), (Some(547.0), None));

    assert_eq!(gps_health.recv_timeout(LONG).map(|report| report.health), Some(GpsHealth::Stable));

    let heartbeat = heartbeats.recv_timeout(LONG).expect("it comes");
    assert_eq!(
        (heartbeat.vehicle_type, heartbeat.autopilot, heartbeat.custom_mode, heartbeat.is_armed),
        (2, 3, 5, true)
    );
    assert!(
        heartbeat.link.messages > 0 && heartbeat.link.sent > 0 && heartbeat.link.bytes_skipped == 0,
        "{heartbeat:?}"
    );
    drop(running);
}

#[test]
fn reported_spoofing_lasts_for_spoofed_for() {
    let other = FlightController::new();
    let mut builder = drone(&other.address);
    builder.options(drone::sensor::base::gps_health).spoofed_for = Duration::from_millis(300);
    let reports = builder.subscribe(drone::sensor::base::gps_health);
    let _running = builder.start().expect("the link can be opened");
    let becomes = |health| std::iter::from_fn(|| reports.recv_timeout(LONG)).find(|report| report.health == health);
    assert!(becomes(GpsHealth::Stable).is_some());
    other.behaviour.is_spoofed.store(true, Ordering::Release);
    let from = becomes(GpsHealth::Spoofed).expect("it says so").monotonic_time;
    other.behaviour.is_spoofed.store(false, Ordering::Release);
    let to = becomes(GpsHealth::Stable).expect("it is over").monotonic_time;
    assert!(to.seconds_since(from) > 0.3, "{from} {to}");
}
