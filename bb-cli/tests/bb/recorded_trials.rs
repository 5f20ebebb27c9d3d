//! Commands on the trials of BROAD, in the folder that `BB_DATA` names.

use crate::common::bb;
use bb_core::Stamped;
use bb_core::payload::{Imu, MagneticField};
use bb_core::time::MonotonicTime;
use bb_mcap::{Bag, BagWriter, RecorderOptions};
use bb_tests::recordings::broad;
use serde_json::Value;
use std::path::Path;

/// 20 s around the first motion of a recording, in SI or as a chip gives them: deg/s, g and µT.
fn cut(recording: &Path, in_si: bool, out: &Path) {
    let (rate, force, field) = if in_si { (1.0, 1.0, 1.0) } else { (180.0 / std::f64::consts::PI, 9.80665, 1e6) };
    let _ = std::fs::remove_file(out);
    let mut writer = BagWriter::create(out, &RecorderOptions::default()).expect("creates");
    let bag = Bag::open(recording).expect("opens");
    let first = bb_mcap::Truth::read(&bag).expect("is whole").first_motion().expect("it moves");
    for message in bag.messages(&["/imu", "/mag"]).expect("are there") {
        let message = message.expect("is whole");
        let since = message.log_time_ns as i64 - first;
        if !(-5_000_000_000..15_000_000_000).contains(&since) {
            continue;
        }
        let header = message.header().expect("has one");
        if &*message.topic == "/imu" {
            let (mut imu, _) = message.payload::<Imu>().expect("is one");
            imu.angular_velocity *= rate;
            imu.linear_acceleration /= force;
            let mut stamped = Stamped::new(MonotonicTime::ZERO, imu);
            stamped.wall_time = header.stamp.wall_time();
            writer.payload("/imu", &stamped).expect("writes");
        } else {
            let (mut sample, _) = message.payload::<MagneticField>().expect("is one");
            sample.magnetic_field *= field;
            let mut stamped = Stamped::new(MonotonicTime::ZERO, sample);
            stamped.wall_time = header.stamp.wall_time();
            writer.payload("/mag", &stamped).expect("writes");
        }
    }
    writer.finish().expect("finishes");
}

/// Slow and fast motion, with breaks, tapping and magnets: in SI nothing looks wrong, in a chip's units all does.
#[test]
#[ignore = "needs recordings: .ci/run runs it"]
fn units_are_recognised_on_real_recordings() {
    for file in broad().expect("they are there") {
        let remarks = |file: &Path| {
            let output = bb(&["info", "--json", file.to_str().expect("is text")]).out;
            // The magnetometer is late, in any unit.
            let is_said = |line: &&str| line.contains("\"text\"") && !line.contains("its stamps are ");
            output.lines().filter(is_said).map(str::to_owned).collect::<Vec<_>>()
        };
        let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("cut.mcap");
        cut(&file, true, &out);
        assert_eq!(remarks(&out), [""; 0], "{}", file.display());
        cut(&file, false, &out);
        let said = remarks(&out);
        let units = ["in g;", "in deg/s", "in µT;"];
        assert_eq!(said.len(), units.len(), "{}: {said:?}", file.display());
        assert!(said.iter().zip(units).all(|(said, unit)| said.contains(unit)), "{}: {said:?}", file.display());
    }
}

#[test]
#[ignore = "needs recordings: .ci/run runs it"]
fn ten_trials() {
    let files = broad().expect("they are there");
    let folder = files[0].parent().expect("is in a folder").to_str().expect("is text");
    let arguments = ["eval", "attitude", folder, "--filter", "madgwick,complementary", "--set", "beta=0.12"];
    let table = bb(&arguments);
    assert_eq!((table.code, &*table.err), (Some(0), ""));
    let json = bb(&[&arguments[..], &["--json"]].concat());
    let rows: Vec<Value> = serde_json::from_str(&json.out).expect("an array");
    assert_eq!(rows.len(), 20);
    // The same figures each time, in the same order.
    let again: Vec<Value> =
        serde_json::from_str(&bb(&[&arguments[..], &["--json"]].concat()).out).expect("an array");
    for (row, again) in rows.iter().zip(&again) {
        for field in ["file", "filter", "total_deg", "heading_deg", "inclination_deg", "samples"] {
            assert_eq!(row[field], again[field]);
        }
    }
    let mean = |filter: &str, field: &str| {
        let of_filter = rows.iter().filter(|row| row["filter"] == filter);
        of_filter.map(|row| row[field].as_f64().expect("a number")).sum::<f64>() / 10.0
    };
    // The published figure of Madgwick with nine axes at this beta is 5.27.
    assert!((mean("madgwick", "total_deg") / 5.27 - 1.0).abs() < 0.05);
    let line = table.out.lines().find(|line| line.starts_with("mean of 10") && line.contains("complementary"));
    let cells: Vec<_> = line.expect("there is one").split_whitespace().collect();
    assert_eq!(cells[4], format!("{:.2}", mean("complementary", "total_deg")));
}

/// Remarks of `bb info` on recordings of others, but for gaps and the jitter of some phones' magnetometers: latencies
/// of magnetometers and of the car's receiver, and magnetometers that nobody calibrated. Nothing is said of units, of
/// covariances, or of a truth.
#[test]
#[ignore = "needs the recordings that BB_DATA names"]
fn remarks_are_true_of_the_recordings_of_others() {
    let data = bb_tests::recordings::families().expect("BB_DATA");
    let mut latencies = 0;
    for folder in ["broad", "phones", "vehicles"] {
        let output = bb(&["info", "--json", data.join(folder).to_str().expect("is text")]);
        assert_eq!(output.code, Some(0), "{}", output.err);
        let rows: Vec<Value> = serde_json::from_str(&output.out).expect("an array");
        for row in &rows {
            let file = Path::new(row["file"].as_str().expect("text")).file_stem().expect("has a name");
            let file = file.to_str().expect("text");
            let topics = row["topics"].as_array().expect("an array").iter();
            let remarks = topics.flat_map(|topic| {
                let name = topic["name"].as_str().expect("text");
                topic["remarks"].as_array().expect("an array").iter().map(move |remark| (name, remark))
            });
            let mut is_calibrated = true;
            for (topic, remark) in remarks {
                let [subject, text] = ["subject", "text"].map(|field| remark[field].as_str().expect("text"));
                let is_true = match subject {
                    "gap" => true,
                    "clock" => topic == "/mag" && text.starts_with("the stamps jitter") && file.contains("iphone"),
                    "latency" => {
                        latencies += 1;
                        let ms = text.strip_prefix("its stamps are ").and_then(|text| text.split(' ').next());
                        let ms: u32 = ms.expect("a latency").parse().expect("a number");
                        match folder {
                            "vehicles" => {
                                file.starts_with("drive") && topic.ends_with("/fix") && (60..=110).contains(&ms)
                            }
                            _ => topic == "/mag" && (10..=34).contains(&ms) && text.contains("after"),
                        }
                    }
                    "unit" | "calibration" if text.contains("not calibrated") => {
                        is_calibrated = false;
                        topic == "/mag" && file.ends_with("_raw")
                    }
                    _ => false,
                };
                assert!(is_true, "{file}: {topic}: {subject}: {text}");
            }
            assert_eq!(is_calibrated, !file.ends_with("_raw"), "{file}");
        }
    }
    assert!(latencies >= 25, "{latencies}");
}
