//! A robot beside a flight controller in Python; see `tests/mavlink/check`.

use super::{Drone, LONG, drone, text};
use bb_core::nalgebra::{UnitQuaternion, Vector3};
use bb_core::payload::GeodeticPosition;
use bb_core::prelude::*;
use bb_estimators::navigation::state_estimator::{FlightEstimate, FlightEvent, FlightEvents, GpsHealth, Level};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, Command as Process, Stdio};
use std::sync::mpsc::{Receiver, channel};

/// The drone, whose bridges both send the flight's estimate.
fn flying(peer: &Peer) -> bb_core::Builder<Drone> {
    let mut builder = drone(&peer.address);
    let position = builder.options(drone::bridge::position);
    (position.geoid_height, position.send_yaw) = (30.0, true);
    builder.options(drone::bridge::odometry).source = "sensor/base/estimate".into();
    builder
}

/// Process of the flight controller; it ends when its input is closed.
struct Peer {
    process: Child,
    address: String,
    received: Receiver<Value>,
}

impl Peer {
    fn start() -> Self {
        let python = std::env::var("BB_MAVLINK_PYTHON").expect("tests/mavlink/check sets it");
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/mavlink/peer.py");
        let mut process = Process::new(python)
            .arg(script)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("Python starts");
        let mut lines = BufReader::new(process.stdout.take().expect("it is piped")).lines().map_while(Result::ok);
        let address = format!("udpout:127.0.0.1:{}", lines.next().expect("it says its port"));
        let (hears, received) = channel();
        std::thread::spawn(move || {
            for line in lines {
                let _ = hears.send(serde_json::from_str(&line).expect("a line of JSON"));
            }
        });
        Self { process, address, received }
    }

    /// Tells it which fault to simulate.
    fn tell(&mut self, what: &str) {
        let input = self.process.stdin.as_mut().expect("it is piped");
        writeln!(input, "{what}").and_then(|()| input.flush()).expect("it reads");
    }

    fn hears(&self, kind: &str, fits: impl Fn(&Value) -> bool) -> Value {
        std::iter::from_fn(|| self.received.recv_timeout(LONG).ok())
            .find(|message| message["mavpackettype"] == kind && fits(message))
            .unwrap_or_else(|| panic!("no {kind} arrived"))
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        drop(self.process.stdin.take());
        let _ = self.process.wait();
    }
}

/// Returns an estimate of a vehicle that points north, in Sydney.
fn estimate(time: MonotonicTime) -> FlightEstimate {
    let (latitude_rad, longitude_rad) = ((-33.8_f64).to_radians(), 151.2_f64.to_radians());
    FlightEstimate {
        position: GeodeticPosition { latitude_rad, longitude_rad, altitude: Some(62.5) },
        world_from_body: UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2),
        resets: 5,
        ..super::estimate(time, 0.0)
    }
}

#[test]
#[ignore = "needs pymavlink: run tests/mavlink/check"]
fn a_robot_and_pymavlink_understand_each_other() {
    let peer = Peer::start();
    let builder = flying(&peer);
    let imu = builder.subscribe(drone::sensor::base::imu);
    let other_imu = builder.subscribe(drone::sensor::base::other_imu);
    let attitude = builder.subscribe(drone::sensor::base::attitude);
    let gps = builder.subscribe(drone::sensor::base::gps);
    let gps_health = builder.subscribe(drone::sensor::base::gps_health);
    let heartbeats = builder.subscribe(drone::sensor::base::heartbeat);
    let running = builder.start().expect("the link can be opened");

    let sample = imu.recv_timeout(LONG).expect("HIGHRES_IMU comes");
    assert_eq!(sample.linear_acceleration, Vector3::new(1.0, -2.0, 9.5));
    assert_eq!(sample.angular_velocity, Vector3::new(0.25, -0.5, -0.75));
    let sample = other_imu.recv_timeout(LONG).expect("SCALED_IMU2 comes");
    assert!((sample.linear_acceleration - Vector3::new(0.980665, -1.96133, 9.80665)).norm() < 1e-12);
    assert!((sample.angular_velocity - Vector3::new(0.01, -0.02, -0.03)).norm() < 1e-12);
    let orientation = attitude.recv_timeout(LONG).expect("ATTITUDE_QUATERNION comes");
    assert!(orientation.world_from_body.angle() < 1e-6);
    let fix = gps.recv_timeout(LONG).expect("GPS_RAW_INT comes");
    let position = fix.position.expect("it has one");
    assert!((position.latitude_rad.to_degrees() + 33.8).abs() < 1e-9);
    assert!((position.longitude_rad.to_degrees() - 151.2).abs() < 1e-9);
    assert_eq!((position.altitude, fix.status), (Some(62.5), GnssStatus::GroundAugmented));
    let deviations = fix.position_covariance.expect("it is known").diagonal().map(f64::sqrt);
    assert!((deviations - Vector3::new(0.02, 0.02, 0.04)).norm() < 1e-12, "{deviations}");
    assert_eq!(gps_health.recv_timeout(LONG).map(|report| report.health), Some(GpsHealth::Stable));
    let said = heartbeats.recv_timeout(LONG).expect("HEARTBEAT comes");
    assert_eq!((said.vehicle_type, said.autopilot, said.custom_mode, said.is_armed), (1, 12, 77, true));
    assert_eq!((said.link.bytes_skipped, said.link.unknown, said.link.invalid), (0, 0, 0), "every frame is read");

    let live = running.live();
    let now = Clock::real().now();
    live.publish(drone::sensor::base::estimate, now, estimate(now));
    let received = peer.hears("GPS_INPUT", |_| true);
    for (name, value) in [("lat", -338_000_000), ("lon", 1_512_000_000), ("yaw", 36_000), ("fix_type", 3)] {
        assert_eq!(received[name], json!(value), "{name}");
    }
    for (name, value) in [("alt", 32.5), ("vn", 2.0), ("ve", 1.0), ("vd", -3.0), ("horiz_accuracy", 2.0)] {
        assert_eq!(received[name], json!(value), "{name}");
    }
    // Accuracy of the speed, and vertical dilution of precision.
    assert_eq!((&received["ignore_flags"], &received["from"]), (&json!(32 + 4), &json!([1, 220])));
    assert_eq!(received["hdop"], json!(1.0));

    live.publish(drone::sensor::base::estimate, now, estimate(now));
    let received = peer.hears("ODOMETRY", |_| true);
    assert_eq!(
        (&received["frame_id"], &received["child_frame_id"], &received["from"]),
        (&json!(1), &json!(12), &json!([1, 197]))
    );
    assert_eq!(received["reset_counter"], json!(5));
    let number = |value: &Value| value.as_f64().expect("it is a number");
    // To the north, where the velocity is 2 m/s forward, 1 m/s to the right and 3 m/s up.
    for (name, value) in [("x", 0.0), ("y", 0.0), ("z", 0.0), ("vx", 2.0), ("vy", 1.0), ("vz", -3.0)] {
        assert!((number(&received[name]) - value).abs() < 1e-6, "{name}: {}", received[name]);
    }
    assert!((number(&received["q"][0]).abs() - 1.0).abs() < 1e-6, "{}", received["q"]);
    assert!((number(&received["pose_covariance"][0]) - 4.0).abs() < 1e-6);
    assert_eq!((&received["rollspeed"], &received["velocity_covariance"][0]), (&Value::Null, &Value::Null));

    let long = "0123456789".repeat(5);
    let event = |said: &str| FlightEvent { kind: "fallback_engaged".into(), ..text(Level::Error, said) };
    let events = vec![event("no estimate"), event(&format!("{long}{long}"))];
    live.publish(drone::sensor::base::events, now, FlightEvents { events });
    let received: Vec<Value> = (0..4).map(|_| peer.hears("STATUSTEXT", |_| true)).collect();
    let texts: Vec<_> =
        received.iter().map(|text| (&text["text"], &text["id"], &text["chunk_seq"], &text["severity"])).collect();
    let [text, first, empty] = ["no estimate", &long, ""].map(|text| json!(text));
    let [zero, one, two] = [0, 1, 2].map(|number| json!(number));
    assert_eq!(
        texts,
        [
            (&text, &zero, &zero, &two),
            (&first, &one, &zero, &two),
            (&first, &one, &one, &two),
            (&empty, &one, &two, &two)
        ]
    );
    for component_id in [220, 197] {
        let hello = peer.hears("HEARTBEAT", |message| message["from"] == json!([1, component_id]));
        assert_eq!((&hello["type"], &hello["autopilot"]), (&json!(18), &json!(8)));
    }
}

#[test]
#[ignore = "needs pymavlink: run tests/mavlink/check"]
fn a_peer_that_stops_lies_or_floods_is_survived_and_reported() {
    let mut peer = Peer::start();
    let builder = flying(&peer);
    let faults = builder.subscribe(system::Faults);
    let readings = builder.subscribe(drone::sensor::base::imu);
    let heartbeats = builder.subscribe(drone::sensor::base::heartbeat);
    let running = builder.start().expect("the link can be opened");
    let measures = || {
        readings.drain().for_each(drop);
        readings.recv_timeout(LONG).expect("it measures")
    };
    for (wrong, said) in
        [("mute", "no HIGHRES_IMU for "), ("ahead 100000", "HIGHRES_IMU: its clock jumped ahead by ")]
    {
        measures();
        peer.tell(wrong);
        std::iter::from_fn(|| faults.recv_timeout(LONG))
            .find(|fault| fault.path == "sensor/base/imu" && fault.message.starts_with(said))
            .unwrap_or_else(|| panic!("{wrong} is not reported"));
        peer.tell("well");
    }
    measures();
    peer.tell("flood");
    heartbeats.drain().for_each(drop);
    let before = heartbeats.recv_timeout(LONG).expect("it comes").link;
    for _ in 0..200 {
        readings.recv_timeout(LONG).expect("it measures");
    }
    let after = heartbeats.drain().last().expect("they come").link;
    assert!(after.messages >= before.messages + 200, "{before:?} {after:?}");
    let report = running.stop();
    assert!(!report.faults.iter().any(|fault| fault.message.contains("hang")), "{report}");
}
