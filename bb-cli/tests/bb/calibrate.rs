//! `bb calibrate imu` on simulated sensors of known errors.

use crate::common::bb;
use crate::common::poses::{Errors, GRAVITY, Read, bag, errors, samples};
use bb_core::nalgebra::{Matrix3, Vector3 as V};
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

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

/// The six faces of the cube, exactly: what Ferraris' method, that of `imucal`, is for.
#[test]
#[ignore = "needs imucal: run tests/imucal/check"]
fn imucal_finds_the_same() {
    let python = std::env::var("BB_IMUCAL_PYTHON").expect("tests/imucal/check sets it");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/imucal/ferraris.py");
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
