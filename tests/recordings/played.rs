//! Recordings in the place of the components that published them.

use super::robot::Temporary;
use bb_core::prelude::*;
use bb_estimators::{Madgwick, SimulatedImu, Vqf};
use bb_mcap::{PlayedEstimator, PlayedOptions, PlayedSensor, Recorder, RecorderOptions};

type Failure = Box<dyn std::error::Error>;

robot! {
    robot Walker;

    link base {
        sensor imu: SimulatedImu(duration = 500 ms) {
            rate: 100 Hz;
            estimator tilt: Madgwick<Marg>();
            estimator other: Vqf<Marg>();
        }
    }
}

const IMU: &str = "sensor/base/imu";
const TILT: &str = "sensor/base/imu/tilt";

#[derive(PartialEq, Debug)]
struct Published {
    samples: Vec<Stamped<Marg>>,
    tilts: Vec<Stamped<Orientation>>,
    others: Vec<Stamped<Orientation>>,
}

/// Runs the robot to its end, with a recorder if `file` is given.
fn run(
    builder: bb_core::Builder<Walker>,
    file: Option<&Temporary>,
) -> Result<(Published, bb_core::run::Report), Failure> {
    let samples = builder.subscribe(walker::sensor::base::imu);
    let tilts = builder.subscribe(walker::sensor::base::imu::tilt);
    let others = builder.subscribe(walker::sensor::base::imu::other);
    let all = builder.subscribe_any(Select::Below("sensor"), None, Overflow::default());
    let mut simulation = builder.simulate()?;
    simulation.run_to_end();
    let report = simulation.stop();
    if let Some(file) = file {
        let mut recorder = Recorder::new(file, all, RecorderOptions::of::<Walker>())?;
        recorder.drain()?;
        recorder.finish()?;
    }
    let published = Published {
        samples: samples.drain().collect(),
        tilts: tilts.drain().collect(),
        others: others.drain().collect(),
    };
    Ok((published, report))
}

fn recorded(name: &str) -> Result<(Temporary, Published), Failure> {
    let file = Temporary::new(name);
    let (published, report) = run(Walker::builder(), Some(&file))?;
    report.ok()?;
    assert_eq!(published.samples.len(), 51);
    assert_eq!(published.tilts.len(), 51);
    Ok((file, published))
}

#[test]
fn a_recorded_sensor_publishes_what_it_measured_and_all_others_run_on_it() -> Result<(), Failure> {
    let (file, first) = recorded("played_sensor")?;
    let mut builder = Walker::builder();
    builder.replace_sensor::<PlayedSensor<Marg>>(IMU, PlayedOptions::of(&file))?;
    let (again, report) = run(builder, None)?;
    report.ok()?;
    assert_eq!(first, again);
    Ok(())
}

/// A delayed message has the stamp of its measurement, and is published later.
#[test]
fn a_recorded_sensor_may_be_as_late_as_it_was() -> Result<(), Failure> {
    let (file, first) = recorded("played_delay")?;
    let mut builder = Walker::builder();
    let options = PlayedOptions { delay: Duration::from_millis(25), ..PlayedOptions::of(&file) };
    builder.replace_sensor::<PlayedSensor<Marg>>(IMU, options)?;
    let samples = builder.subscribe(walker::sensor::base::imu);
    let tilts = builder.subscribe(walker::sensor::base::imu::tilt);
    let mut simulation = builder.simulate()?;
    let mut published = Vec::new();
    while simulation.step() {
        let now = simulation.clock().now();
        for sample in samples.drain() {
            assert_eq!(now.nanos_since(sample.monotonic_time), 25_000_000);
            published.push(sample);
        }
    }
    simulation.stop().ok()?;
    assert_eq!(published, first.samples);
    assert_eq!(tilts.drain().collect::<Vec<_>>(), first.tilts);
    Ok(())
}

#[test]
fn a_recorded_estimator_emits_what_it_emitted() -> Result<(), Failure> {
    let (file, first) = recorded("played_estimator")?;
    let mut builder = Walker::builder();
    // The algorithm would now give another result.
    builder.options(walker::sensor::base::imu::tilt).beta = 0.9;
    builder.options(walker::sensor::base::imu::other).tilt_time_constant = 0.5;
    builder.replace_sensor::<PlayedSensor<Marg>>(IMU, PlayedOptions::of(&file))?;
    builder.replace_estimator::<PlayedEstimator<Marg, Orientation>>(TILT, PlayedOptions::of(&file))?;
    let (again, report) = run(builder, None)?;
    report.ok()?;
    assert_eq!((&first.samples, &first.tilts), (&again.samples, &again.tilts));
    assert_ne!(first.others, again.others);
    Ok(())
}

#[test]
fn an_estimator_beside_a_live_sensor_emits_the_newest_recorded_message_once() -> Result<(), Failure> {
    let (file, first) = recorded("played_offset")?;
    let mut builder = Walker::builder();
    // 15 ms later: between two samples.
    let options = PlayedOptions { offset: 0.015, ..PlayedOptions::of(&file) };
    builder.replace_estimator::<PlayedEstimator<Marg, Orientation>>(TILT, options)?;
    let (again, report) = run(builder, None)?;
    report.ok()?;
    assert_eq!(again.tilts.len(), 49);
    for (then, now) in first.tilts.iter().zip(&again.tilts) {
        assert_eq!(then.payload, now.payload);
        assert_eq!(now.monotonic_time.nanos_since(then.monotonic_time), 20_000_000);
    }
    Ok(())
}

#[test]
fn what_was_not_recorded_keeps_the_robot_from_starting() -> Result<(), Failure> {
    let (file, _) = recorded("played_errors")?;
    let start = |options: PlayedOptions| {
        let mut builder = Walker::builder();
        builder.replace_sensor::<PlayedSensor<Marg>>(IMU, options).map(|()| builder.simulate())
    };
    let error = start(PlayedOptions { path: "sensor/base/gnss".into(), ..PlayedOptions::of(&file) })?;
    let error = error.expect_err("no such path").to_string();
    assert!(error.starts_with("sensor/base/imu cannot start: ") && error.contains("`sensor/base/gnss`"), "{error}");

    let error = start(PlayedOptions { path: TILT.into(), ..PlayedOptions::of(&file) })?;
    let error = error.expect_err("another payload").to_string();
    assert!(error.contains("Orientation") && error.contains("Marg"), "{error}");

    let error = start(PlayedOptions::of("no such file"))?.expect_err("no such file").to_string();
    assert!(error.contains("no such file"), "{error}");
    Ok(())
}

/// A damaged file would be damaged again after a restart.
#[test]
fn a_recording_that_breaks_off_stops_what_plays_it() -> Result<(), Failure> {
    let (file, first) = recorded("played_broken")?;
    let bytes = std::fs::read(&file)?;
    std::fs::write(&file, &bytes[..bytes.len() / 2])?;
    let mut builder = Walker::builder();
    builder.replace_sensor::<PlayedSensor<Marg>>(IMU, PlayedOptions::of(&file))?;
    let (again, report) = run(builder, None)?;
    assert!(again.samples.len() < 51);
    assert_eq!(first.samples[..again.samples.len()], again.samples);
    let faults: Vec<_> = report.faults.iter().map(|fault| fault.path).collect();
    assert_eq!(faults, [IMU], "{report}");

    let mut builder = Walker::builder();
    builder.replace_estimator::<PlayedEstimator<Marg, Orientation>>(TILT, PlayedOptions::of(&file))?;
    let (again, report) = run(builder, None)?;
    assert!(again.tilts.len() < 51);
    assert_eq!(first.tilts[..again.tilts.len()], again.tilts);
    let faults: Vec<_> = report.faults.iter().map(|fault| fault.path).collect();
    assert_eq!(faults, [TILT], "{report}");
    Ok(())
}
