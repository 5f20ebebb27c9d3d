//! `bb info`, `echo`, `hz`, `plot` and `recover`, on small recordings made here.

use crate::common::bags::ros::{Header, Imu, MagneticField, Stamp, Vector3};
use crate::common::bags::{Maker, little};
use crate::common::{bb, file};
use bb_core::message::Schema;
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
    let info = info(&walk.file(name));
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
        said.starts_with("unit: the angular velocity looks to be in deg/s: over a second gravity turns"),
        "{said}"
    );
    let said = unit(Walk { field: 0.48, ..Walk::default() }, "info_gauss.mcap");
    assert_eq!(said, "unit: the magnetic field has a median of 0.480: it looks to be in gauss; ROS has T");
    let said = unit(Walk { field: 48.0, ..Walk::default() }, "info_ut.mcap");
    assert_eq!(said, "unit: the magnetic field has a median of 48.000: it looks to be in µT; ROS has T");
    let all = Walk { force: 1.0, gyroscope: 57.29578, field: 48.0, ..Walk::default() };
    assert_eq!(remarks(&all, "info_units.mcap").len(), 3);
}

#[test]
fn gaps_and_clocks_are_told_with_their_places() {
    let gap = remarks(&Walk { missing: 400..450, ..Walk::default() }, "info_gap.mcap");
    assert_eq!(gap, ["gap: 1 gap of more than 3 periods; the longest is 0.510 s, after 3.990 s"; 2]);
    let stamp = |index: u64, log: u64| if index == 500 { log - 15_000_000 } else { log };
    let back = remarks(&Walk { stamp, ..Walk::default() }, "info_back.mcap");
    assert_eq!(back[0], "clock: 1 stamp goes back in time; the farthest by 0.005000 s, at 5.000 s");
    let boot = remarks(&Walk { stamp: |index, _| 5 + index * 10_000_000, ..Walk::default() }, "info_boot.mcap");
    assert!(boot[0].starts_with("clock: the stamps are 1700000000.000 s before the log times"), "{boot:?}");
}

#[test]
fn what_a_damaged_file_holds_is_told_and_saved() {
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
    let output = bb(&["plot", name, "/imu.angular_velocty", "--out", out]);
    assert_eq!(output.code, Some(1));
    assert!(
        output.err.ends_with("/imu: no field `angular_velocty`; did you mean `angular_velocity`?\n"),
        "{}",
        output.err
    );
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
    /// Its value.
    value: f64,
    /// It may have one.
    name: Option<String>,
    /// Where it is from.
    kind: Kind,
}

/// Where a number is from.
#[derive(Clone, Debug, Payload)]
enum Kind {
    /// From nowhere.
    NotYetKnown,
    /// From an instrument.
    Measured {
        /// What it is known to.
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
    let picture = path.with_extension("svg");
    let arguments = ["plot", path.to_str().expect("is text"), "sensor/base/number", "--out"];
    let output = bb(&[&arguments[..], &[picture.to_str().expect("is text")]].concat());
    assert_eq!(output.code, Some(0), "{}", output.err);
    let svg = std::fs::read_to_string(&picture).expect("is written");
    assert!(svg.contains("number payload") && !svg.contains("wall_time"), "times are no curves");
}
