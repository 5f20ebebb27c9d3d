//! Streams that stop, have wrong clocks or flood, and wrong options.

use super::{LONG, drone, fault_of_imu};
use crate::other::FlightController;
use bb_core::prelude::*;
use std::sync::atomic::Ordering;

#[test]
fn a_stream_that_stops_is_reported_and_comes_back() {
    let other = FlightController::new();
    let builder = drone(&other.address);
    let faults = builder.subscribe(system::Faults);
    let readings = builder.subscribe(drone::sensor::base::imu);
    let running = builder.start().expect("the link can be opened");
    readings.recv_timeout(LONG).expect("it measures");

    other.behaviour.is_mute.store(true, Ordering::Release);
    let stopped = fault_of_imu(&faults, "no HIGHRES_IMU for ");
    assert!(stopped.contains(" s: heartbeats still come, the last "), "{stopped}");
    // The restarted driver has seen none.
    let again = fault_of_imu(&faults, "no HIGHRES_IMU in the ");
    assert!(again.contains(" s since the driver started: "), "{again}");

    other.behaviour.is_mute.store(false, Ordering::Release);
    readings.drain().for_each(drop);
    readings.recv_timeout(LONG).expect("it measures again");

    other.behaviour.is_empty.store(true, Ordering::Release);
    let empty = fault_of_imu(&faults, "HIGHRES_IMU arrives, but for ");
    assert!(
        empty.ends_with(
            " s without a value that can be used: `fields_updated` lacks acceleration or angular velocity"
        ),
        "{empty}"
    );
    other.behaviour.is_empty.store(false, Ordering::Release);
    readings.drain().for_each(drop);
    readings.recv_timeout(LONG).expect("it measures again");
    let report = running.stop();
    let imu = report.sources.iter().find(|source| source.path == "sensor/base/imu").expect("it is in the report");
    assert!(imu.restarts >= 3, "{report}");
}

#[test]
fn a_flight_controller_that_is_gone_is_distinguished_from_a_stream_that_stops() {
    let other = FlightController::new();
    other.behaviour.is_dead.store(true, Ordering::Release);
    other.behaviour.is_mute.store(true, Ordering::Release);
    let builder = drone(&other.address);
    let faults = builder.subscribe(system::Faults);
    let _running = builder.start().expect("the link can be opened");
    let message = fault_of_imu(&faults, "no HIGHRES_IMU in the ");
    assert!(message.ends_with(" s since the driver started: nor has a heartbeat come"), "{message}");
}

#[test]
fn a_clock_that_jumps_is_reported_and_readings_go_on() {
    let other = FlightController::new();
    let mut builder = drone(&other.address);
    // So that nothing else restarts the driver, which would then not know the previous clock.
    builder.options(drone::sensor::base::imu).timeout = LONG;
    let faults = builder.subscribe(system::Faults);
    let readings = builder.subscribe(drone::sensor::base::imu);
    let _running = builder.start().expect("the link can be opened");
    for (ahead_ms, said) in
        [(100_000, "HIGHRES_IMU: its clock jumped ahead by "), (0, "HIGHRES_IMU: its clock went back by ")]
    {
        readings.drain().for_each(drop);
        readings.recv_timeout(LONG).expect("it measures");
        other.behaviour.ahead_ms.store(ahead_ms, Ordering::Release);
        fault_of_imu(&faults, said);
    }
    readings.drain().for_each(drop);
    let reading = readings.recv_timeout(LONG).expect("it measures");
    assert!(reading.monotonic_time <= Clock::real().now());
}

#[test]
fn a_clock_that_stands_still_is_reported() {
    let other = FlightController::new();
    other.behaviour.is_still.store(true, Ordering::Release);
    let builder = drone(&other.address);
    let faults = builder.subscribe(system::Faults);
    let _running = builder.start().expect("the link can be opened");
    let message = fault_of_imu(&faults, "HIGHRES_IMU: its clock has stood still for ");
    assert!(message.ends_with(" s, although messages arrive"), "{message}");
}

#[test]
fn a_flood_holds_up_neither_readings_nor_the_stop() {
    let other = FlightController::new();
    other.behaviour.floods.store(true, Ordering::Release);
    let builder = drone(&other.address);
    let readings = builder.subscribe(drone::sensor::base::imu);
    let running = builder.start().expect("the link can be opened");
    for _ in 0..500 {
        readings.recv_timeout(LONG).expect("it measures");
    }
    // The flood goes on.
    let report = running.stop();
    assert!(!report.faults.iter().any(|fault| fault.message.contains("hang")), "{report}");
}

#[test]
fn options_that_are_wrong_say_so_at_the_start() {
    let other = FlightController::new();
    let fails = |change: &dyn Fn(&mut bb_core::Builder<super::Drone>)| {
        let mut builder = drone(&other.address);
        change(&mut builder);
        builder.start().map(|_| ()).expect_err("it is wrong").to_string()
    };
    let rows: [(String, &str); 6] = [
        (
            fails(&|builder| builder.options(drone::sensor::base::imu).link = "udpin:x".into()),
            "the link `udpin:x` has no port",
        ),
        (
            fails(&|builder| builder.options(drone::sensor::base::imu).message = "raw_imu".into()),
            "message is `raw_imu`: write `highres_imu` or `scaled_imu2`",
        ),
        (
            fails(&|builder| builder.options(drone::bridge::position).message = "gps".into()),
            "message is `gps`: write `gps_input` or `odometry`",
        ),
        (
            fails(&|builder| builder.options(drone::bridge::position).component_id = 0),
            "it cannot speak as system 1, component 0: both ids are from 1 to 255",
        ),
        (
            fails(&|builder| builder.options(drone::bridge::position).source = "sensor/base/estimat".into()),
            "did you mean `sensor/base/estimate`?",
        ),
        (
            fails(&|builder| builder.options(drone::bridge::position).source = "sensor/base/odometry".into()),
            "`sensor/base/odometry` publishes `Odometry`, not `FlightEstimate`",
        ),
    ];
    for (message, expected) in rows {
        assert!(message.contains(expected), "{message}\n{expected}");
    }
}
