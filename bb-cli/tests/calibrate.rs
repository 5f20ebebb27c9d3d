//! `bb calibrate imu` on simulated sensors of known errors, and beside Python's `imucal` where that is there.

mod common;

use bags::ros::*;
use bb_core::nalgebra::{Matrix3, UnitQuaternion, Vector3 as V};
use common::{bags, bb};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

const GRAVITY: f64 = 9.81;
const PERIOD_NS: u64 = 10_000_000;

/// What the simulated sensors are wrong by.
struct Errors {
    gyroscope: V<f64>,
    accelerometer: (V<f64>, Matrix3<f64>),
    magnetometer: (V<f64>, Matrix3<f64>),
}

fn errors() -> Errors {
    Errors {
        gyroscope: V::new(0.02, -0.01, 0.005),
        accelerometer: (V::new(0.3, -0.2, 0.1), Matrix3::new(1.02, 0.01, -0.02, 0.0, 0.98, 0.015, 0.0, 0.0, 1.01)),
        magnetometer: (V::new(2e-5, -4e-5, 1e-5), Matrix3::new(1.05, 0.02, 0.0, 0.02, 0.97, 0.01, 0.0, 0.01, 1.0)),
    }
}

/// One sample as the sensors read it: angular velocity, specific force, field.
type Read = [V<f64>; 3];

/// Three seconds in each of 24 orientations, with a turn of a second between; noise that is the same each time.
fn samples(errors: &Errors) -> Vec<Read> {
    let orientation = |index: usize| {
        // All faces of a cube to the ground, each turned and leaning a little.
        let axes = [V::z(), -V::z(), V::x(), -V::x(), V::y(), -V::y()];
        let face = UnitQuaternion::rotation_between(&axes[index % 6], &V::z());
        let face = face.unwrap_or_else(|| UnitQuaternion::from_axis_angle(&V::x_axis(), std::f64::consts::PI));
        let lean = 0.25 * (index / 6) as f64;
        UnitQuaternion::from_euler_angles(lean, -lean, index as f64) * face
    };
    let inverse = |(offset, matrix): &(V<f64>, Matrix3<f64>), truth: V<f64>| {
        matrix.try_inverse().expect("near 1") * truth + offset
    };
    let mut state = 1_u32;
    // Xorshift; of a mean of 0 and a deviation of 1, even.
    let mut even = || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        (f64::from(state) / f64::from(u32::MAX) - 0.5) * 12_f64.sqrt()
    };
    let mut noise = |deviation: f64| V::new(even(), even(), even()) * deviation;
    let mut samples = Vec::new();
    for pose in 0..24 {
        let (from, to) = (orientation(pose), orientation(pose + 1));
        for i in 0..400 {
            let part = (f64::from(i) - 300.0).max(0.0) / 100.0;
            let world_from_body = from.slerp(&to, part);
            let rate = if i < 300 { V::zeros() } else { (from.inverse() * to).scaled_axis() };
            let force = world_from_body.inverse() * V::new(0.0, 0.0, GRAVITY);
            let shaken = if i < 300 { 0.02 } else { 1.0 };
            let field = world_from_body.inverse() * V::new(0.0, 20e-6, -44e-6);
            samples.push([
                rate + errors.gyroscope + noise(0.002),
                inverse(&errors.accelerometer, force + noise(shaken)),
                inverse(&errors.magnetometer, field + noise(2e-7)),
            ]);
        }
    }
    samples
}

fn bag(samples: &[Read], name: &str, magnetometer: bool) -> PathBuf {
    let mut maker = bags::Maker::new(mcap::WriteOptions::new());
    let imu_topic = maker.topic("/imu", "sensor_msgs/msg/Imu");
    let mag_topic = magnetometer.then(|| maker.topic("/mag", "sensor_msgs/msg/MagneticField"));
    let vector = |v: &V<f64>| Vector3 { x: v.x, y: v.y, z: v.z };
    for (index, [rate, force, field]) in samples.iter().enumerate() {
        let time = PERIOD_NS * (index as u64 + 1);
        let stamp = Stamp { sec: (time / 1_000_000_000) as i32, nanosec: (time % 1_000_000_000) as u32 };
        let header = Header { stamp, frame_id: "imu".into() };
        let imu = Imu {
            header: header.clone(),
            angular_velocity: vector(rate),
            linear_acceleration: vector(force),
            ..Imu::default()
        };
        maker.bytes_at(imu_topic, time, &bags::little(&imu));
        if let Some(topic) = mag_topic {
            let field = MagneticField { header, magnetic_field: vector(field), ..MagneticField::default() };
            maker.bytes_at(topic, time, &bags::little(&field));
        }
    }
    bags::file(name, &maker.finish())
}

/// The numbers of a line `key = […]`.
fn numbers(out: &str, key: &str) -> Vec<f64> {
    let line = out.lines().find_map(|line| line.strip_prefix(&format!("{key} = ")));
    let line = line.unwrap_or_else(|| panic!("no `{key}` in {out}"));
    let number = |text: &str| text.trim().parse().expect("a number");
    line.replace(['[', ']'], "").split(',').map(number).collect()
}

fn text(path: &Path) -> &str {
    path.to_str().expect("is text")
}

#[test]
fn simulated_errors_are_found_and_printed_as_they_are_pasted() {
    let errors = errors();
    let file = bag(&samples(&errors), "calibrate.mcap", true);
    let plot = Path::new(env!("CARGO_TARGET_TMPDIR")).join("calibrate.svg");
    let field = format!("{}uT", 20_f64.hypot(44.0));
    let output =
        bb(&["calibrate", "imu", text(&file), "--gravity", "9.81", "--field", &field, "--plot", text(&plot)]);
    assert_eq!(output.code, Some(0), "{}", output.err);
    let near = |key: &str, truth: &[f64], bound: f64| {
        for (found, truth) in numbers(&output.out, key).iter().zip(truth) {
            assert!((found - truth).abs() < bound, "{key}: {found}, is {truth}\n{}", output.out);
        }
    };
    let rows = |matrix: &Matrix3<f64>| matrix.transpose().as_slice().to_vec();
    // Four deviations, by the noise: 24 rests of some 200 samples; a rest's mean is known to 2.4 mm/s².
    near("gyroscope_offset", errors.gyroscope.as_slice(), 4.0 * 0.002 / (24.0 * 200_f64).sqrt());
    near("accelerometer_offset", errors.accelerometer.0.as_slice(), 4.0 * 2.4e-3 / 8_f64.sqrt());
    near("accelerometer_matrix", &rows(&errors.accelerometer.1), 4.0 * 2.4e-3 / GRAVITY);
    // What the field's noise, 0.4 %, leaves of 9,600 samples that are not in all directions alike.
    near("magnetometer_offset", errors.magnetometer.0.as_slice(), 1e-7);
    near("magnetometer_matrix", &rows(&errors.magnetometer.1), 2e-3);
    assert!(std::fs::read_to_string(&plot).expect("is there").contains("magnetic field"));
}

#[test]
fn what_is_missing_is_said_and_the_rest_calibrated() {
    let samples = samples(&errors());
    let file = bag(&samples[..1200], "calibrate_three.mcap", false);
    let output = bb(&["calibrate", "imu", text(&file)]);
    assert_eq!(output.code, Some(0), "{}", output.err);
    assert!(output.out.contains("gyroscope_offset = ["), "{}", output.out);
    assert!(output.out.contains("# accelerometer: not calibrated: there are 3 directions"), "{}", output.out);
    assert!(output.out.contains("# magnetometer: not calibrated: no field was recorded"), "{}", output.out);
    let file = bag(&samples[300..390], "calibrate_moving.mcap", false);
    let output = bb(&["calibrate", "imu", text(&file)]);
    assert_eq!(output.code, Some(1), "{}", output.out);
    for (arguments, fault) in [
        (&["--set", "forse=1"][..], "did you mean `force`?"),
        (&["--set", "force=1 kg"], "its unit is m/s^2"),
        (&["--gravity", "1000"], "must be in 1..=30 m/s²"),
        (&["--mag-topic", "/mag"], "/mag"),
    ] {
        let output = bb(&[&["calibrate", "imu", text(&file)], arguments].concat());
        assert!(output.code == Some(1) && output.err.contains(fault), "{arguments:?}: {}", output.err);
    }
    assert_eq!(bb(&["calibrate", "imu"]).code, Some(2));
}

/// The six faces of the cube, exactly: what Ferraris' method, that of `imucal`, is for. `BB_PYTHON` names a Python with it.
#[test]
fn imucal_finds_the_same() {
    let python = std::env::var("BB_PYTHON").unwrap_or_else(|_| "python3".into());
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/imucal/ferraris.py");
    let is_there =
        Command::new(&python).args(["-c", "import imucal"]).output().is_ok_and(|out| out.status.success());
    if !is_there {
        // To the terminal itself: the test harness keeps what a passing test prints.
        let _ = writeln!(std::io::stderr(), "skipped: {python} has no imucal; pip install imucal");
        return;
    }
    let errors = Errors {
        accelerometer: (errors().accelerometer.0, Matrix3::from_diagonal(&V::new(1.02, 0.98, 1.01))),
        ..errors()
    };
    let ups = [V::x(), -V::x(), V::y(), -V::y(), V::z(), -V::z()];
    let mut samples: Vec<Read> = Vec::new();
    for up in ups {
        let force = errors.accelerometer.1.try_inverse().expect("near 1") * (up * GRAVITY) + errors.accelerometer.0;
        for i in 0..400 {
            let shaken = if i < 300 { 0.01 } else { 3.0 } * f64::from(i % 3 - 1);
            samples.push([errors.gyroscope, force + V::repeat(shaken), V::zeros()]);
        }
    }
    let file = bag(&samples, "calibrate_cube.mcap", false);
    let csv = Path::new(env!("CARGO_TARGET_TMPDIR")).join("calibrate_cube.csv");
    let rows = samples.iter().fold(String::new(), |mut rows, [rate, force, _]| {
        let _ = writeln!(rows, "{},{},{},{},{},{}", force.x, force.y, force.z, rate.x, rate.y, rate.z);
        rows
    });
    std::fs::write(&csv, rows).expect("there is room");
    let theirs = Command::new(&python).arg(&script).arg(&csv).arg(GRAVITY.to_string()).output().expect("runs");
    assert!(theirs.status.success(), "{}", String::from_utf8_lossy(&theirs.stderr));
    let theirs = String::from_utf8(theirs.stdout).expect("is text");
    let ours = bb(&["calibrate", "imu", text(&file), "--gravity", "9.81"]);
    assert_eq!(ours.code, Some(0), "{}", ours.err);
    for (key, bound) in [("accelerometer_offset", 1e-3), ("accelerometer_matrix", 1e-4), ("gyroscope_offset", 1e-6)]
    {
        for (ours, theirs) in numbers(&ours.out, key).iter().zip(numbers(&theirs, key)) {
            assert!((ours - theirs).abs() < bound, "{key}: {ours}, imucal has {theirs}");
        }
    }
}
