//! Messages that the drivers publish.

use super::{Drone, LONG, drone};
use crate::other::Other;
use bb_core::nalgebra::Vector3;
use bb_core::prelude::*;
use bb_estimators::navigation::state_estimator::GpsHealth;
use std::sync::atomic::Ordering;

#[test]
fn all_sensors_of_one_link_publish_in_the_axes_of_the_framework() {
    let other = Other::new();
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

    let said = heartbeats.recv_timeout(LONG).expect("it comes");
    assert_eq!((said.vehicle_type, said.autopilot, said.custom_mode, said.is_armed), (2, 3, 5, true));
    assert!(said.link.messages > 0 && said.link.sent > 0 && said.link.bytes_skipped == 0, "{said:?}");
    drop(running);
}

#[test]
fn a_receiver_that_is_said_to_be_spoofed_is_so_for_a_while() {
    let other = Other::new();
    let mut builder = drone(&other.address);
    builder.options(drone::sensor::base::gps_health).spoofed_for = Duration::from_millis(300);
    let reports = builder.subscribe(drone::sensor::base::gps_health);
    let _running = builder.start().expect("the link can be opened");
    let becomes = |health| std::iter::from_fn(|| reports.recv_timeout(LONG)).find(|report| report.health == health);
    assert!(becomes(GpsHealth::Stable).is_some());
    other.does.is_spoofed.store(true, Ordering::Release);
    let from = becomes(GpsHealth::Spoofed).expect("it says so").monotonic_time;
    other.does.is_spoofed.store(false, Ordering::Release);
    let to = becomes(GpsHealth::Stable).expect("it is over").monotonic_time;
    assert!(to.seconds_since(from) > 0.3, "{from} {to}");
}
