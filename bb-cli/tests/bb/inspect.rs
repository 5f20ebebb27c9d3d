//! `bb info`, `echo`, `hz`, `plot` and `recover`, on small recordings made here.

use crate::common::bags::ros::{
    Header, Imu, MagneticField, NavSatFix, Odometry, Pose, PoseStamped, Quaternion, Stamp, Vector3,
};
use crate::common::bags::{Maker, little};
use crate::common::{bb, file};
use bb_core::message::Schema;
use bb_core::nalgebra;
use bb_core::prelude::*;
use mcap::WriteOptions;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// A bag of an IMU at 100 Hz, which turns by sin(t) rad/s about x, and a magnetometer.
struct Walk {
    gyroscope: f64,
    force: f64,
    field: f64,
    /// The stamp of a sample, nanoseconds; else that of the log.
    stamp: fn(u64, u64) -> u64,
    /// Samples that are not there.
    missing: std::ops::Range<u64>,
}

impl Default for Walk {
    fn default() -> Self {
        Self { gyroscope: 1.0, force: 9.81, field: 48e-6, stamp: |_, log| log, missing: 0..0 }
    }
}

const START_NS: u64 = 1_700_000_000_000_000_000;

impl Walk {
    fn bytes(&self) -> Vec<u8> {
        let mut maker = Maker::new(WriteOptions::new().chunk_size(Some(20_000)));
        let (imu, mag) = (maker.topic("/imu", IMU), maker.topic("/mag", "sensor_msgs/msg/MagneticField"));
        for index in (0..1000).filter(|index| !self.missing.contains(index)) {
            let time = index as f64 * 0.01;
            let log = START_NS + index * 10_000_000;
            let stamp = (self.stamp)(index, log);
            let stamp = Stamp { sec: (stamp / 1_000_000_000) as i32, nanosec: (stamp % 1_000_000_000) as u32 };
            let header = Header { stamp, frame_id: "imu".into() };
            // The angle is the integral of the rate.
            let angle = 1.0 - time.cos();
            let sample = Imu {
                header: header.clone(),
                angular_velocity: Vector3 { x: self.gyroscope * time.sin(), y: 0.0, z: 0.0 },
                linear_acceleration: Vector3 { x: 0.0, y: self.force * angle.sin(), z: self.force * angle.cos() },
                ..Imu::default()
            };
            maker.bytes_at(imu, log, &little(&sample));
            let field = Vector3 { x: self.field, y: 0.0, z: 0.0 };
            maker.bytes_at(
                mag,
                log,
                &little(&MagneticField { header, magnetic_field: field, ..Default::default() }),
            );
        }
        maker.finish()
    }

    fn file(&self, name: &str) -> PathBuf {
        file(name, &self.bytes())
    }
}

const IMU: &str = "sensor_msgs/msg/Imu";

fn info(file: &Path) -> Value {
    let output = bb(&["info", "--json", file.to_str().expect("is text")]);
    let mut rows: Vec<Value> = serde_json::from_str(&output.out).unwrap_or_else(|_| panic!("{}", output.err));
    rows.remove(0)
}

/// The remarks of all topics, after their subjects.
fn remarks(walk: &Walk, name: &str) -> Vec<String> {
    remarks_of(&walk.file(name))
}

fn remarks_of(file: &Path) -> Vec<String> {
    let info = info(file);
    let topics = info["topics"].as_array().expect("an array");
    let remarks = topics.iter().flat_map(|topic| topic["remarks"].as_array().expect("an array"));
    let text = |value: &Value| value.as_str().expect("text").to_owned();
    remarks.map(|remark| format!("{}: {}", text(&remark["subject"]), text(&remark["text"]))).collect()
}

#[test]
fn a_good_recording_is_described_without_remarks() {
    let path = Walk::default().file("info_good.mcap");
    let row = info(&path);
    assert_eq!((&row["messages"], &row["start_ns"]), (&2000.into(), &START_NS.into()));
    assert_eq!(row["duration_s"], 9.99);
    let imu = &row["topics"][0];
    assert_eq!((&imu["name"], &imu["type"], &imu["messages"]), (&"/imu".into(), &IMU.into(), &1000.into()));
    assert!((imu["rate_hz"].as_f64().expect("a number") - 100.0).abs() < 1e-9);
    assert_eq!(remarks(&Walk::default(), "info_good.mcap"), [""; 0]);
    let text = bb(&["info", path.to_str().expect("is text")]);
    assert_eq!((text.code, &*text.err), (Some(0), ""));
    assert!(text.out.contains("10.0 s from 2023-11-14 22:13:20 UTC, 2000 messages on 2 topics"), "{}", text.out);
}

#[test]
fn units_that_look_wrong_are_named() {
    let unit = |walk: Walk, name| {
        let remarks = remarks(&walk, name);
        assert_eq!(remarks.len(), 1, "{remarks:?}");
        remarks[0].clone()
    };
    let said = unit(Walk { force: 1.0, ..Walk::default() }, "info_g.mcap");
    assert_eq!(said, "unit: the specific force has a median of 1.000: it looks to be in g; ROS has m/s²");
    let said = unit(Walk { gyroscope: 57.29578, ..Walk::default() }, "info_deg.mcap");
    assert!(
        said.starts_with(
            "unit: the angular velocity looks to be in deg/s: where the body does not accelerate, gravity turns"
        ),
        "{said}"
    );
    let said = unit(Walk { gyroscope: 1.0 / 57.29578, ..Walk::default() }, "info_twice.mcap");
    let lead =
        "unit: the angular velocity looks to be converted from deg/s to rad/s twice: where the body does not";
    assert!(said.starts_with(lead), "{said}");
    let said = unit(Walk { field: 0.48, ..Walk::default() }, "info_gauss.mcap");
    assert_eq!(said, "unit: the magnetic field has a median of 0.480: it looks to be in gauss; ROS has T");
    let said = unit(Walk { field: 48.0, ..Walk::default() }, "info_ut.mcap");
    assert_eq!(said, "unit: the magnetic field has a median of 48.000: it looks to be in µT; ROS has T");
    let all = Walk { force: 1.0, gyroscope: 57.29578, field: 48.0, ..Walk::default() };
    assert_eq!(remarks(&all, "info_units.mcap").len(), 3);
}

#[test]
fn gaps_and_clocks_are_reported_with_their_places() {
    let gap = remarks(&Walk { missing: 400..450, ..Walk::default() }, "info_gap.mcap");
    assert_eq!(gap, ["gap: 1 gap of more than 3 periods; the longest is 0.510 s, after 3.990 s"; 2]);
    let stamp = |index: u64, log: u64| if index == 500 { log - 15_000_000 } else { log };
    let back = remarks(&Walk { stamp, ..Walk::default() }, "info_back.mcap");
    assert_eq!(back[0], "clock: 1 stamp goes back in time; the farthest by 0.005000 s, at 5.000 s");
    let boot = remarks(&Walk { stamp: |index, _| 5 + index * 10_000_000, ..Walk::default() }, "info_boot.mcap");
    assert!(boot[0].starts_with("clock: the stamps are 1700000000.000 s before the log times"), "{boot:?}");
}

/// A minute of a hand that turns an IMU about, with a magnetometer, a truth of it, and fixes of a car on a winding road.
#[derive(Clone, Copy)]
struct Turns {
    /// Delays of the stamps of magnetometer, truth and fixes, s.
    late_s: [f64; 3],
    /// The deviation of fixes in the second half, of all that state 1 cm, m.
    scatter: f64,
    /// Offset of the magnetometer, T.
    offset: f64,
    /// Jitter of the IMU's stamps, half milliseconds.
    jitter: u64,
    /// The gyroscope's unit, rad/s.
    unit: f64,
    /// Steps of an odometry that its pose is ahead of its twist, and one without a number.
    ahead: Option<(u64, u64)>,
}

impl Turns {
    fn remarks(self, name: &str) -> Vec<String> {
        remarks_of(&self.file(name))
    }

    fn file(self, name: &str) -> PathBuf {
        let mut maker = Maker::new(WriteOptions::new().chunk_size(Some(50_000)));
        let topics = [
            ("/imu", IMU),
            ("/mag", "sensor_msgs/msg/MagneticField"),
            ("/truth", "geometry_msgs/msg/PoseStamped"),
            ("/fix", "sensor_msgs/msg/NavSatFix"),
        ]
        .map(|(topic, schema)| maker.topic(topic, schema));
        let wheels = self.ahead.map(|_| maker.topic("/wheels", "nav_msgs/msg/Odometry"));
        let header = |time_ns: u64, frame: &str| {
            let stamp = Stamp { sec: (time_ns / 1_000_000_000) as i32, nanosec: (time_ns % 1_000_000_000) as u32 };
            Header { stamp, frame_id: frame.into() }
        };
        let vector = |v: nalgebra::Vector3<f64>| Vector3 { x: v.x, y: v.y, z: v.z };
        let turned = |time: f64| {
            let angles = [(1.3 * time).sin(), 0.7 * (2.1 * time).cos(), 1.2 * (0.9 * time).sin()];
            nalgebra::UnitQuaternion::from_scaled_axis(nalgebra::Vector3::from(angles))
        };
        for index in 0..6000_u64 {
            let time = index as f64 * 0.01;
            let log = START_NS + index * 10_000_000;
            let late = |late_s: f64| (log as i64 + (late_s * 1e9) as i64) as u64;
            let rotation = turned(time);
            let rate = (turned(time - 5e-4).inverse() * turned(time + 5e-4)).scaled_axis() / 1e-3;
            // North and east, 20 m/s: 6 m to both sides.
            let place = nalgebra::Vector3::new(6.0 * (0.8 * time).sin(), 20.0 * time, 0.0);
            let force = nalgebra::Vector3::new(-6.0 * 0.64 * (0.8 * time).sin(), 0.0, 9.81);
            let sample = Imu {
                header: header(log + index * 7 % 11 * self.jitter * 500_000, "imu_link"),
                angular_velocity: vector(rate / self.unit),
                linear_acceleration: vector(rotation.inverse() * force),
                ..Imu::default()
            };
            maker.bytes_at(topics[0], log, &little(&sample));
            if index % 2 == 0 {
                let field = rotation.inverse() * nalgebra::Vector3::new(0.0, 2e-5, -4e-5);
                let magnetic_field = vector(field.add_scalar(self.offset));
                let stamped = header(late(self.late_s[0]), "imu_link");
                let field = MagneticField { header: stamped, magnetic_field, ..Default::default() };
                maker.bytes_at(topics[1], log, &little(&field));
                let orientation = Quaternion { x: rotation.i, y: rotation.j, z: rotation.k, w: rotation.w };
                let pose = Pose { orientation, ..Pose::default() };
                let stamped = header(late(self.late_s[1]), "world");
                maker.bytes_at(topics[2], log, &little(&PoseStamped { header: stamped, pose }));
            }
            if let (Some(wheels), Some((ahead, lost)), 0) = (wheels, self.ahead, index % 5) {
                let turned = turned(time + ahead as f64 * 0.05);
                let mut odometry = Odometry { header: header(log, "odom"), ..Odometry::default() };
                odometry.pose.pose.orientation = Quaternion { x: turned.i, y: turned.j, z: turned.k, w: turned.w };
                odometry.twist.twist.angular = vector(rate);
                odometry.twist.twist.linear.x = if index == lost { f64::NAN } else { 0.0 };
                maker.bytes_at(wheels, log, &little(&odometry));
            }
            if index % 20 == 0 {
                let deviation = if index < 3000 { 0.01 } else { self.scatter };
                let noise = |axis: u64| {
                    let bits = ((index * 3 + axis + 1) as u32).wrapping_mul(2_654_435_761) >> 8;
                    (f64::from(bits) / f64::from(1 << 23) - 1.0) * 3_f64.sqrt() * deviation
                };
                let metres = 6_378_137.0_f64.to_radians();
                let fix = NavSatFix {
                    header: header(late(self.late_s[2]), "gps"),
                    latitude: (place.y + noise(0)) / metres,
                    longitude: (place.x + noise(1)) / metres,
                    altitude: noise(2),
                    position_covariance: [1e-4, 0.0, 0.0, 0.0, 1e-4, 0.0, 0.0, 0.0, 1e-4],
                    position_covariance_type: 2,
                    ..Default::default()
                };
                maker.bytes_at(topics[3], log, &little(&fix));
            }
        }
        file(name, &maker.finish())
    }
}

/// Faults between sensors are reported, each by itself.
#[test]
fn latencies_scatter_offsets_and_jitter_are_reported() {
    let good = Turns { late_s: [0.0; 3], scatter: 0.01, offset: 0.0, jitter: 0, unit: 1.0, ahead: None };
    assert_eq!(good.remarks("info_turns.mcap"), [""; 0]);
    let late = |late_s| Turns { late_s, ..good }.remarks("info_late.mcap");
    let said = |ms: u32, order: &str, what: &str| {
        format!("latency: its stamps are {ms} ms {order} those of /imu for the same motion, as {what} of both show")
    };
    assert_eq!(late([0.04, 0.0, 0.0]), [said(40, "after", "the turns")]);
    assert_eq!(late([0.0, -0.02, 0.0]), [said(20, "before", "the turns")]);
    assert_eq!(late([0.0, 0.0, 0.12]), [said(120, "after", "the accelerations")]);
    let scatter = Turns { scatter: 4.0, ..good }.remarks("info_scatter.mcap");
    assert_eq!(scatter.len(), 1, "{scatter:?}");
    assert!(scatter[0].starts_with("covariance: 15"), "{scatter:?}");
    assert!(scatter[0].contains(" of 300 fixes, from 29."), "{scatter:?}");
    assert!(scatter[0].ends_with("m about the motion that /imu measures, and state 1.7 cm"), "{scatter:?}");
    let offset = Turns { offset: 3e-5, ..good }.remarks("info_offset.mcap");
    assert_eq!(
        offset,
        [
            "calibration: the magnetometer is not calibrated: its readings lie on a sphere of 45 µT about (30, 30, 30) µT"
        ]
    );
    // To filters too the truth is late, and the gyroscope too small; its motion has no rest that shows gravity.
    let doubts = |file: &Path| {
        let output = bb(&["eval", "attitude", file.to_str().expect("is text"), "--filter", "mekf"]);
        output
            .err
            .lines()
            .filter(|line| !line.contains("refused"))
            .map(str::to_owned)
            .collect::<Vec<_>>()
            .join("\n")
    };
    let late = doubts(&Turns { late_s: [0.0, 0.06, 0.0], ..good }.file("eval_late.mcap"));
    assert!(
        late.ends_with(
            "/truth: its stamps are 60 ms after those of /imu for the same motion, as the turns of both show"
        ),
        "{late}"
    );
    let small = Turns { unit: 57.29578, ..good };
    let said = "it turns 57.296 times as much as /imu says, whose angular velocity looks to be converted from deg/s to rad/s twice; ROS has rad/s";
    let remarks = small.remarks("info_small.mcap");
    for topic in ["/mag", "/truth"] {
        assert!(remarks.iter().any(|remark| *remark == format!("unit: {said}")), "{topic}: {remarks:?}");
    }
    assert!(doubts(&small.file("eval_small.mcap")).contains(&format!("/truth: {said}")));
    // A pose that holds the step after its stamp, and a velocity that does not; and one message without a number.
    let wheels = Turns { ahead: Some((1, 500)), ..good }.remarks("info_wheels.mcap");
    assert_eq!(wheels, ["values: 1 message holds NaN or infinity"]);
    let jitter = Turns { jitter: 1, ..good }.remarks("info_jitter.mcap");
    assert!(jitter[0].starts_with("clock: the stamps jitter: of the periods of "), "{jitter:?}");
}

#[test]
fn frames_are_listed() {
    let output = bb(&["info", Walk::default().file("info_frames.mcap").to_str().expect("is text")]);
    let head = output.out.lines().nth(2).expect("a head");
    assert_eq!(head.split_whitespace().take(3).collect::<Vec<_>>(), ["topic", "type", "frame"], "{}", output.out);
    assert!(output.out.contains("sensor_msgs/msg/Imu            imu        1000"), "{}", output.out);
}

#[test]
fn contents_of_a_damaged_file_are_reported_and_saved() {
    let bytes = Walk::default().bytes();
    let path = file("info_cut.mcap", &bytes[..bytes.len() / 2]);
    let name = path.to_str().expect("is text");
    let output = bb(&["info", name]);
    assert_eq!(output.code, Some(1));
    let row = info(&path);
    let before = row["messages"].as_u64().expect("a number");
    assert!((200..1900).contains(&before), "{before}");
    assert!(row["damage"].as_str().expect("text").starts_with(&format!("truncated after {before} messages")));
    assert!(output.out.contains(&format!("to save the {before} messages before it: bb recover {name} NEW.mcap")));

    let whole = path.with_file_name("info_whole.mcap");
    let _ = std::fs::remove_file(&whole);
    let saved = bb(&["recover", name, whole.to_str().expect("is text")]);
    assert_eq!(saved.code, Some(0), "{}", saved.err);
    assert!(saved.out.ends_with(&format!("{before} messages, all before the break\n")), "{}", saved.out);
    assert_eq!((&info(&whole)["messages"], &info(&whole)["damage"]), (&before.into(), &Value::Null));
    let again = bb(&["recover", name, whole.to_str().expect("is text")]);
    assert_eq!(again.code, Some(1));
    assert!(again.err.contains("it exists already"), "{}", again.err);

    let text = file("info_text.mcap", b"t,x\n1,2\n");
    let output = bb(&["info", text.to_str().expect("is text"), whole.to_str().expect("is text")]);
    assert_eq!(output.code, Some(1));
    assert!(output.err.contains("info_text.mcap: not an MCAP file"), "{}", output.err);
    assert!(output.out.contains("info_whole.mcap"), "one bad file does not hide the others: {}", output.out);
}

#[test]
fn a_topic_is_echoed_as_text_and_as_json() {
    let path = Walk::default().file("echo.mcap");
    let name = path.to_str().expect("is text");
    let output = bb(&["echo", name, "/imu", "--limit", "2"]);
    assert_eq!((output.code, &*output.err), (Some(0), ""));
    assert_eq!(output.out.matches("---\n").count(), 2);
    assert!(
        output.out.starts_with("header:\n  stamp:\n    sec: 1700000000\n    nanosec: 0\n  frame_id: \"imu\"\n")
    );
    assert!(output.out.contains("linear_acceleration:\n  x: 0.0\n  y: 0.0\n  z: 9.81\n"), "{}", output.out);
    // The slash may be left out.
    let output = bb(&["echo", name, "mag", "--json"]);
    let lines: Vec<Value> =
        output.out.lines().map(|line| serde_json::from_str(line).expect("an object a line")).collect();
    assert_eq!(lines.len(), 1000);
    assert_eq!(lines[3]["log_time_ns"], START_NS + 30_000_000);
    assert_eq!(lines[3]["message"]["magnetic_field"]["x"], 48e-6);
    let output = bb(&["echo", name, "/imuu"]);
    assert_eq!(output.code, Some(1));
    assert!(output.err.ends_with("echo.mcap: no topic /imuu; did you mean `/imu`?\n"), "{}", output.err);
}

/// Types that nobody has heard of are read by the definition in the file, in CDR and in JSON.
#[test]
fn any_type_is_read_by_its_definition() {
    let mut writer = WriteOptions::new().create(std::io::Cursor::new(Vec::new())).expect("starts");
    let text = "Part[] parts\nuint8[4] bytes\nstring name\n===\nMSG: my/Part\nint16 number\nfloat32 size\n";
    let schema = writer.add_schema("my/msg/Whole", Schema::ENCODING, text.as_bytes()).expect("writes");
    let cdr = writer.add_channel(schema, "/whole", "cdr", &Default::default()).expect("writes");
    let json = writer.add_channel(0, "/json", "json", &Default::default()).expect("writes");
    let other = writer.add_channel(0, "/other", "protobuf", &Default::default()).expect("writes");
    let whole = (vec![(-7_i16, 0.5_f32), (8, 1.5)], [1_u8, 2, 3, 4], "a name");
    let mut write = |channel_id, data: &[u8]| {
        let header = mcap::records::MessageHeader { channel_id, sequence: 0, log_time: 5, publish_time: 5 };
        writer.write_to_known_channel(&header, data).expect("writes");
    };
    write(cdr, &little(&whole));
    write(json, br#"{"z": 1, "a": {"b": [true, null, "x"]}}"#);
    write(other, b"?");
    write(json, b"{");
    writer.finish().expect("finishes");
    let path = file("any.mcap", writer.into_inner().get_ref());
    let name = path.to_str().expect("is text");
    assert_eq!(
        bb(&["echo", name, "/whole"]).out,
        "parts:\n  - number: -7\n    size: 0.5\n  - number: 8\n    size: 1.5\nbytes: [1, 2, 3, 4]\nname: \"a name\"\n---\n"
    );
    let output = bb(&["echo", name, "/json"]);
    assert_eq!(output.out, "z: 1\na:\n  b: [true, NaN, \"x\"]\n---\n");
    assert!(output.err.contains("a message of /json is not JSON"), "{}", output.err);
    let output = bb(&["echo", name, "/other"]);
    assert!(output.err.contains("encoded as `protobuf`, and only `cdr` and `json` are read"), "{}", output.err);
    // It is counted all the same.
    assert_eq!(info(&path)["messages"], 4);
}

#[test]
fn rates_are_those_of_the_stamps() {
    let walk = Walk { missing: 100..110, stamp: |index, _| START_NS + index * 20_000_000, ..Walk::default() };
    let path = walk.file("hz.mcap");
    let output = bb(&["hz", path.to_str().expect("is text"), "--json", "/imu", "imu"]);
    let rows: Vec<Value> = serde_json::from_str(&output.out).expect("an array");
    assert_eq!(rows.len(), 1);
    let number = |field: &str| rows[0]["period"][field].as_f64().expect("a number");
    // 20 ms, and once 220 ms.
    assert!((number("median_s") - 0.02).abs() < 1e-9 && (number("max_s") - 0.22).abs() < 1e-9);
    assert!((number("mean_s") - (988.0 * 0.02 + 0.22) / 989.0).abs() < 1e-9);
    assert_eq!((&rows[0]["messages"], &rows[0]["gaps"]), (&990.into(), &1.into()));
    let table = bb(&["hz", path.to_str().expect("is text")]).out;
    assert_eq!(table.lines().count(), 3, "{table}");
    assert!(table.contains("20.000 ms  220.000 ms"), "{table}");
}

#[test]
fn fields_are_plotted_with_their_units() {
    let path = Walk::default().file("plot.mcap");
    let name = path.to_str().expect("is text");
    let out = path.with_extension("svg");
    let out = out.to_str().expect("is text");
    let output = bb(&["plot", name, "/imu", "/mag.magnetic_field.x", "--out", out]);
    assert_eq!(output.code, Some(0), "{}", output.err);
    let svg = std::fs::read_to_string(out).expect("is written");
    for text in
        ["angular_velocity (rad/s)", "linear_acceleration (m/s²)", "x (T)", "time (s)", "/imu angular_velocity"]
    {
        assert!(svg.contains(text), "{text}");
    }
    assert!(!svg.contains("covariance"));
    // A topic whose name has dots, one of which is the name of another.
    let mut maker = Maker::new(WriteOptions::new());
    for topic in ["/imu", "/imu.left", "/imu.left.raw"] {
        let imu = maker.topic(topic, IMU);
        (0..9).for_each(|index| maker.bytes_at(imu, START_NS + index, &little(&Imu::default())));
    }
    let dotted = file("plot_dotted.mcap", &maker.finish());
    let dotted = dotted.to_str().expect("is text");
    for (field, title) in [
        ("/imu.left.raw.angular_velocity", "/imu.left.raw angular_velocity"),
        ("imu.left.angular_velocity.x", "/imu.left angular_velocity.x"),
        ("/imu.left", "/imu.left linear_acceleration"),
    ] {
        let output = bb(&["plot", dotted, field, "--out", out]);
        assert_eq!(output.code, Some(0), "{}", output.err);
        assert!(std::fs::read_to_string(out).expect("is written").contains(title), "{field}");
    }
    for (field, fault) in [
        ("/imu.angular_velocty", "/imu: no field `angular_velocty`; did you mean `angular_velocity`?\n"),
        ("/imuu.angular_velocity", "no topic /imuu; did you mean `/imu`?\n"),
    ] {
        let output = bb(&["plot", name, field, "--out", out]);
        assert_eq!(output.code, Some(1));
        assert!(output.err.ends_with(fault), "{}", output.err);
    }
    let output = bb(&["plot", name, "/imu", "--out", "x.jpg"]);
    assert_eq!(output.code, Some(2));
    assert!(output.err.contains("--out writes an SVG or a PNG: call the file x.svg or .png"), "{}", output.err);
}

robot! {
    robot Watched;
    link base { sensor number: External<Number>(); }
}

/// A payload that ROS has no message for.
#[derive(Clone, Debug, Payload)]
struct Number {
    /// Value of the number.
    value: f64,
    /// Name, if it has one.
    name: Option<String>,
    /// Origin of the number.
    kind: Kind,
}

/// Origin of a number.
#[derive(Clone, Debug, Payload)]
enum Kind {
    /// Unknown origin.
    NotYetKnown,
    /// Reading of an instrument.
    Measured {
        /// Uncertainty.
        within: f64,
    },
}

#[test]
fn own_recordings_are_read_like_others() {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("own_look.mcap");
    let _ = std::fs::remove_file(&path);
    let builder = Watched::builder();
    let all = builder.subscribe_any(Select::Below("sensor"), None, Overflow::default());
    let mut recorder =
        bb_mcap::Recorder::new(&path, all, bb_mcap::RecorderOptions::of::<Watched>()).expect("starts");
    let mut simulation = builder.simulate().expect("starts");
    for value in 0..3 {
        simulation.run_for(Duration::from_millis(100));
        let kind = if value == 2 { Kind::Measured { within: 0.5 } } else { Kind::NotYetKnown };
        let number = Number { value: f64::from(value), name: (value == 1).then(|| "one".to_owned()), kind };
        simulation.publish(watched::sensor::base::number, simulation.clock().now(), number);
        recorder.drain().expect("there is room");
    }
    recorder.finish().expect("there is room");
    let output = bb(&["echo", path.to_str().expect("is text"), "sensor/base/number", "--json"]);
    let values: Vec<Value> =
        output.out.lines().map(|line| serde_json::from_str(line).expect("an object a line")).collect();
    let payloads: Vec<_> = values.iter().map(|line| line["message"]["payload"].to_string()).collect();
    assert_eq!(
        payloads,
        [
            r#"{"kind":{"kind":"NOT_YET_KNOWN","measured":[]},"name":[],"value":0.0}"#,
            r#"{"kind":{"kind":"NOT_YET_KNOWN","measured":[]},"name":["one"],"value":1.0}"#,
            r#"{"kind":{"kind":"MEASURED","measured":[{"within":0.5}]},"name":[],"value":2.0}"#
        ]
    );
    // The names are in the file; what reads it knows nothing of the type.
    let output = bb(&["echo", path.to_str().expect("is text"), "sensor/base/number"]);
    assert!(output.out.contains("    kind: MEASURED\n    measured:\n      - within: 0.5\n"), "{}", output.out);
    assert!(!output.out.contains("[]"), "what is not there is left out: {}", output.out);
    assert_eq!(remarks_of(&path), [""; 0]);
    let picture = path.with_extension("svg");
    let arguments = ["plot", path.to_str().expect("is text"), "sensor/base/number", "--out"];
    let output = bb(&[&arguments[..], &[picture.to_str().expect("is text")]].concat());
    assert_eq!(output.code, Some(0), "{}", output.err);
    let svg = std::fs::read_to_string(&picture).expect("is written");
    assert!(svg.contains("number payload") && !svg.contains("wall_time"), "times are no curves");
}
