//! `bb eval attitude` on what the project records itself.

use crate::common::eval;
use bb_core::nalgebra::{UnitQuaternion, Vector3};
use bb_core::prelude::*;
use bb_estimators::{Madgwick, SimulatedImu};
use bb_mcap::{Recorder, RecorderOptions};
use std::path::Path;

robot! {
    robot Walker;

    link base {
        sensor imu: SimulatedImu() { rate: 100 Hz; estimator orientation: Madgwick<Marg>(); }
        sensor place: External<Pose>();
        joint mount: fixed { link mast { sensor imu: SimulatedImu() { rate: 100 Hz; } } }
    }
}

/// A recording of one path or of a subtree.
fn record(name: &str, select: Select<'_>) -> std::path::PathBuf {
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_file(&file);
    let builder = Walker::builder();
    let selected = builder.subscribe_any(select, None, Overflow::default());
    let mut recorder = Recorder::new(&file, selected, RecorderOptions::of::<Walker>()).expect("it can be created");
    let mut simulation = builder.simulate().expect("it starts");
    for _ in 0..30 {
        simulation.run_for(Duration::from_millis(100));
        let world_from_body = UnitQuaternion::identity();
        let pose = Pose { position: Vector3::zeros(), world_from_body, covariance: None };
        simulation.publish(walker::sensor::base::place, simulation.clock().now(), pose);
        recorder.drain().expect("there is room");
    }
    recorder.finish().expect("there is room");
    file
}

#[test]
fn a_recording_of_one_imu_needs_no_options() {
    let file = record("own.mcap", Select::Path("sensor/base/imu"));
    let output = eval(&[&file], &[]);
    assert_eq!(output.code, Some(0), "{}", output.err);
    assert!(output.err.contains("no truth, so no errors"), "{}", output.err);
}

#[test]
fn of_several_imus_one_is_named_and_its_magnetometer_follows() {
    let file = record("own_two.mcap", Select::Below("sensor/base"));
    let output = eval(&[&file], &[]);
    assert_ne!(output.code, Some(0));
    let said = output.out + &output.err;
    assert!(said.contains("/sensor/base/imu, /sensor/base/mount/mast/imu"), "{said}");
    let imu = ["--imu-topic", "/sensor/base/mount/mast/imu"];
    let output = eval(&[&file], &imu);
    assert_eq!(output.code, Some(0), "{}", output.err);
    // A score against an estimate would look like one against the truth.
    assert!(output.err.contains("no truth, so no errors: the poses of /sensor/base/place"), "{}", output.err);
    let output = eval(&[&file], &[imu[0], imu[1], "--truth", "/sensor/base/place"]);
    assert_eq!((output.code, &*output.err), (Some(0), ""));
}
