//! `bb eval noise` on simulated noise of known densities, and on what is no noise at rest.

use crate::common::bags::ros::*;
use crate::common::noise::Noise;
use crate::common::{bags, bb, file};
use bb_core::nalgebra::Vector3 as V;
use serde_json::Value;
use std::fmt::Write;
use std::path::{Path, PathBuf};

const GYROSCOPE: f64 = 2e-4;
const ACCELEROMETER: f64 = 2e-3;
const WALK: f64 = 1e-4;
const RATE: f64 = 100.0;

pub(crate) type Sample = (i64, V<f64>, V<f64>);

/// An IMU at rest: white noise, and a gyroscope whose bias walks.
pub(crate) fn night(seed: u64, seconds: f64) -> Vec<Sample> {
    let mut noise = Noise::new(seed);
    let mut bias = V::new(0.01, -0.02, 0.005);
    let sample = |i: i64| {
        bias += noise.vector(WALK / RATE.sqrt());
        let rate = bias + noise.vector(GYROSCOPE * RATE.sqrt());
        (i * 10_000_000, rate, V::new(0.1, 0.2, 9.8) + noise.vector(ACCELEROMETER * RATE.sqrt()))
    };
    (0..(seconds * RATE) as i64).map(sample).collect()
}

pub(crate) fn bag(name: &str, samples: &[Sample]) -> PathBuf {
    driven(name, samples, None)
}

/// A bag with wheels that turn from this time on, s.
fn driven(name: &str, samples: &[Sample], from_s: Option<f64>) -> PathBuf {
    let mut maker = bags::Maker::new(mcap::WriteOptions::new());
    let topic = maker.topic("/imu", "sensor_msgs/msg/Imu");
    let wheels = from_s.map(|from_s| (from_s, maker.topic("/wheels", "nav_msgs/msg/Odometry")));
    let vector = |v: &V<f64>| Vector3 { x: v.x, y: v.y, z: v.z };
    for (time_ns, rate, force) in samples {
        let moves = |(from_s, _): &(f64, _)| *time_ns as f64 * 1e-9 >= *from_s;
        let speed = if wheels.as_ref().is_some_and(moves) { 1.0 } else { 0.0 };
        let time_ns = time_ns + 1_700_000_000_000_000_000;
        let stamp = Stamp { sec: (time_ns / 1_000_000_000) as i32, nanosec: (time_ns % 1_000_000_000) as u32 };
        let header = Header { stamp, frame_id: "imu".into() };
        if let Some((_, wheels)) = wheels {
            let mut odometry = Odometry { header: header.clone(), ..Odometry::default() };
            odometry.twist.twist.linear.x = speed;
            maker.bytes_at(wheels, time_ns as u64, &bags::little(&odometry));
        }
        let imu =
            Imu { header, angular_velocity: vector(rate), linear_acceleration: vector(force), ..Imu::default() };
        maker.bytes_at(topic, time_ns as u64, &bags::little(&imu));
    }
    file(name, &maker.finish())
}

fn text(path: &Path) -> &str {
    path.to_str().expect("is text")
}

fn noise_of(file: &Path) -> (Value, String) {
    let output = bb(&["eval", "noise", text(file), "--json"]);
    let mut found: Vec<Value> = serde_json::from_str(&output.out).expect("an array");
    assert!(output.code == Some(0) && found.len() == 1, "{}", output.err);
    (found.remove(0), output.err)
}

fn number(value: &Value, path: &str) -> f64 {
    let found = value.pointer(path).and_then(Value::as_f64);
    found.unwrap_or_else(|| panic!("{path} is no number: {value}"))
}

/// A quarter of an hour: 90,000 samples tell a density within √(3 / 4 n), 0.29 %, as a χ² of 2 n / 3 degrees of freedom does.
#[test]
fn densities_are_found() {
    let found = bag("night.mcap", &night(1, 900.0));
    let (found, said) = noise_of(&found);
    let bound = 4.0 * (0.75 / 90_000.0_f64).sqrt();
    for axis in ["x", "y", "z"] {
        for (sensor, density) in [("gyroscope", GYROSCOPE), ("accelerometer", ACCELEROMETER)] {
            let at = |name: &str| number(&found, &format!("/{sensor}/{axis}/{name}"));
            let error = at("noise_density") / density - 1.0;
            assert!(error.abs() < bound, "{sensor} {axis}: {error}");
            // The walk makes the gyroscope's a little worse known.
            assert!(at("noise_density_deviation") < 0.4 * bound * density, "{sensor} {axis}");
        }
        let at = |name: &str| number(&found, &format!("/gyroscope/{axis}/{name}"));
        let error = (at("random_walk") - WALK).abs();
        assert!(
            error < 3.5 * at("random_walk_deviation") && at("random_walk_deviation") < 0.3 * WALK,
            "{axis}: {error}"
        );
        assert_eq!(found.pointer(&format!("/gyroscope/{axis}/bias_instability_is_lowest")), Some(&true.into()));
        let most = number(&found, &format!("/accelerometer/{axis}/random_walk_at_most"));
        assert!(most < 0.3 * ACCELEROMETER, "{axis}: {most}");
    }
    assert!((number(&found, "/rate_hz") - RATE).abs() < 1e-6 && (number(&found, "/seconds") - 899.99).abs() < 1e-6);
    assert_eq!(said, "");
    let option = |name: &str| number(&found, &format!("/options/{name}"));
    assert!((option("gyroscope_noise") / GYROSCOPE - 1.0).abs() < bound);
    assert!((option("gyroscope_bias_walk") / WALK - 1.0).abs() < 0.6);
}

/// The options are taken by the filters that they are for.
#[test]
fn options_can_be_pasted() {
    let rows =
        night(2, 60.0).iter().fold(String::from("t,gx,gy,gz,ax,ay,az\n"), |mut rows, (time_ns, rate, force)| {
            let t = *time_ns as f64 * 1e-9;
            let _ = writeln!(rows, "{t},{},{},{},{},{},{}", rate.x, rate.y, rate.z, force.x, force.y, force.z);
            rows
        });
    let csv = file("night.csv", rows.as_bytes());
    let plot = Path::new(env!("CARGO_TARGET_TMPDIR")).join("allan.svg");
    let output = bb(&["eval", "noise", text(&csv), "--plot", text(&plot)]);
    assert_eq!(output.code, Some(0), "{}", output.err);
    let svg = std::fs::read_to_string(&plot).expect("is there");
    for said in ["averaging time (s)", "Allan deviation (rad/s)", "gyroscope z", "accelerometer x, white", "1e-1"] {
        assert!(svg.contains(said), "{said}");
    }
    let line = output.out.lines().find_map(|line| line.strip_prefix("Eskf")).expect("is there");
    let inner = line.strip_prefix('(').and_then(|line| line.strip_suffix(')')).expect("in parentheses");
    let options: Vec<_> = inner.split(", ").map(|option| option.replace(' ', "")).collect();
    // The gyroscope's walk may be more than the default: a minute does not tell.
    assert_eq!(options.len(), 3, "{}", output.out);
    let mut arguments = vec!["eval".to_owned(), "navigation".to_owned(), "none.mcap".to_owned()];
    arguments.extend(options.into_iter().flat_map(|option| ["--set".to_owned(), option]));
    let output = bb(&arguments.iter().map(String::as_str).collect::<Vec<_>>());
    // All are known and in their range: what is missing is the recording.
    assert!(output.code == Some(1) && output.err.contains("no such file"), "{}", output.err);
}

#[test]
fn what_is_no_rest_is_named_and_left_out() {
    let good = night(3, 120.0);
    // Picked up after 90 s.
    let mut moved = good.clone();
    for (index, (_, rate, force)) in moved.iter_mut().enumerate().skip(9000).take(300) {
        rate.y += 0.5 * (index as f64 * 0.05).sin();
        force.x += 2.0 * (index as f64 * 0.03).cos();
    }
    let (found, said) = noise_of(&bag("moved.mcap", &moved));
    assert!(said.contains("gyroscope y moves in") && said.contains("most at 9"), "{said}");
    assert!(said.contains("taken from 0.0 to 90.0 s"), "{said}");
    assert!((number(&found, "/gyroscope/y/noise_density") / GYROSCOPE - 1.0).abs() < 0.04, "{found}");
    // A pause of a second, and samples without a number.
    let mut gaps = good.clone();
    gaps.drain(4000..4100);
    gaps[200].1.x = f64::NAN;
    let (_, said) = noise_of(&bag("gaps.mcap", &gaps));
    assert!(said.contains("samples are missing 1 time, first for 1.010 s after 39.99 s"), "{said}");
    assert!(
        said.contains("1 samples are no numbers, the first at 2.00 s")
            && said.contains("taken from 41.0 to 120.0 s"),
        "{said}"
    );

    let mut saturated = good.clone();
    let mut coarse = good.clone();
    for (index, (_, rate, force)) in saturated.iter_mut().enumerate() {
        force.z = force.z.min(9.81);
        rate.x = (rate.x / 0.005).round() * 0.005;
        coarse[index].2.y = (coarse[index].2.y / 0.1).round() * 0.1;
    }
    let (_, said) = noise_of(&bag("saturated.mcap", &saturated));
    assert!(said.contains("accelerometer z is saturated") && said.contains("are the largest, 9.81"), "{said}");
    let (_, said) = noise_of(&bag("coarse.mcap", &coarse));
    assert!(said.contains("accelerometer y has") && said.contains("values only"), "{said}");
}

/// Steady driving is quiet too: rest is what is quieter, or where the wheels stand.
#[test]
fn steady_driving_is_no_rest() {
    let mut noise = Noise::new(6);
    let shaken = |(time_ns, rate, force): &Sample| match *time_ns > 15_000_000_000 {
        true => (*time_ns, *rate, force + noise.vector(0.2)),
        false => (*time_ns, *rate, *force),
    };
    let good = night(5, 120.0);
    let drive: Vec<_> = good.iter().map(shaken).collect();
    let (found, said) = noise_of(&bag("drive.mcap", &drive));
    assert!(said.contains("taken from 0.0 to 15.0 s"), "{said}");
    let density = number(&found, "/accelerometer/x/noise_density");
    assert!((density / ACCELEROMETER - 1.0).abs() < 0.1, "{density}");
    // What is not seen in so short a time is no option of a filter.
    assert!(found.pointer("/options/accelerometer_bias_walk") == Some(&Value::Null), "{found}");
    let (found, said) = noise_of(&driven("smooth.mcap", &good, Some(15.0)));
    assert!(said.contains("/wheels moves for 10") && said.contains("taken from 0.0 to 14.0 s"), "{said}");
    assert_eq!(found["at_rest_by"], serde_json::json!(["/wheels"]));
    let standing = noise_of(&driven("standing.mcap", &good, Some(1e9)));
    assert_eq!(standing.1, "");
}

#[test]
fn what_gives_no_noise_is_an_error() {
    let good = night(4, 60.0);
    let fault = |samples: &[Sample], name: &str, said: &str| {
        let output = bb(&["eval", "noise", text(&bag(name, samples))]);
        assert!(output.code == Some(1) && output.err.contains(said), "{said}: {}", output.err);
        output.out
    };
    let mut constant = good.clone();
    let mut turning = good.clone();
    let mut shaken = good.clone();
    for (index, (_, rate, force)) in constant.iter_mut().enumerate() {
        force.x = 0.0;
        rate.y = 0.25;
        turning[index].1.z += 0.3;
        if index % 500 < 150 {
            shaken[index].1 *= 100.0;
        }
    }
    constant.iter_mut().for_each(|(_, rate, _)| rate.y = 0.01);
    let out = fault(&constant, "constant.mcap", "accelerometer x: all samples are the same");
    assert!(out.contains("accelerometer y: ") && out.contains("gyroscope y: none"), "{out}");
    // So small that its square is no number that can be divided by.
    let tiny: Vec<_> = good.iter().map(|(time, rate, force)| (*time, rate * 1e-160, force * 1e-160)).collect();
    let out = fault(&tiny, "tiny.mcap", "gyroscope x: samples vary by");
    assert!(!out.contains("NaN"), "{out}");
    fault(&turning, "turning.mcap", "gyroscope z reads 0.30 rad/s on average: the IMU turns, or is not in rad/s");
    fault(&shaken, "shaken.mcap", "s are at rest without a gap, and 10 s are the least (gyroscope");
    fault(&good[..500], "short.mcap", "at most 5.0 s are at rest without a gap");
    fault(&good[..1], "one.mcap", "1 samples are too few");
    let output = bb(&["eval", "noise", "no_such.mcap", "no_such.csv"]);
    assert!(output.code == Some(1) && output.err.contains("no_such.mcap: no such file"), "{}", output.err);
    assert!(output.err.contains("no_such.csv: there is no such file"), "{}", output.err);
    assert_eq!(bb(&["eval", "noise"]).code, Some(2));
    let broken = std::fs::read(bag("whole_night.mcap", &good)).expect("is there");
    let broken = file("broken_night.mcap", &broken[..broken.len() * 2 / 3]);
    let output = bb(&["eval", "noise", text(&broken)]);
    assert!(output.code == Some(1) && output.err.contains("taken up to there"), "{}", output.err);
    assert!(output.out.contains("gyroscope_noise = "), "{}", output.out);
}
