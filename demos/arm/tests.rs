//! The output is the stored one, what is missing is named, and the recording can be read.

use crate::expected::Outcome;
use crate::robot::Ur5;
use crate::tip::Tip;
use crate::{Arguments, run, tell};
use bb_core::prelude::*;
use bb_mcap::Recording;
use std::error::Error;
use std::path::PathBuf;

fn arguments(name: &str) -> Arguments {
    let file = format!("arm-{name}-{}.mcap", std::process::id());
    let record = std::env::temp_dir().join(file);
    Arguments { real_time: false, plot: Some(record.with_extension("svg")), record: Some(record) }
}

#[test]
fn the_story_on_virtual_time_is_the_stored_one_and_is_recorded() -> Result<(), Box<dyn Error>> {
    let arguments = arguments("story");
    let mut out = Vec::new();
    assert!(tell(&arguments, &mut out)?, "{}", String::from_utf8_lossy(&out));
    // To renew it: cargo run --example arm > demos/arm/expected.txt
    assert_eq!(String::from_utf8(out)?, include_str!("expected.txt"));
    let file = arguments.record.ok_or("it is recorded")?;
    recorded(&file)?;
    std::fs::remove_file(&file)?;
    let plot = arguments.plot.ok_or("it is plotted")?;
    let drawn = std::fs::read_to_string(&plot)?;
    std::fs::remove_file(&plot)?;
    assert!(
        ["position (deg)", "shoulder_pan", "wrist_3", "no IMU at the tip"]
            .iter()
            .all(|label| drawn.contains(label))
    );
    Ok(())
}

/// Checks that a recording holds what viewers need, and the events.
fn recorded(file: &PathBuf) -> Result<(), Box<dyn Error>> {
    let recording = Recording::open(file)?;
    let count = |path: &str| {
        let channel = recording.channels().iter().find(|channel| channel.path == path);
        channel.map_or(0, |channel| channel.messages)
    };
    assert!(count("bridge/joint_states") > 700);
    for path in ["command/follow/progress", "command/resume/progress", "health", "state_machine"] {
        assert!(count(path) > 0, "nothing at {path}");
    }
    for actuator in Ur5::ACTUATORS {
        assert!(count(&format!("{}/begin_motion", actuator.path)) >= 5, "{}", actuator.path);
        assert!(count(&format!("{}/end_motion", actuator.path)) >= 5, "{}", actuator.path);
    }
    let tips: Result<Vec<_>, _> = recording.messages::<Tip>("estimator/base/tip")?.collect();
    let gaps =
        tips?.windows(2).filter(|two| two[1].monotonic_time.seconds_since(two[0].monotonic_time) > 1.0).count();
    assert_eq!(gaps, 1, "while the IMU was unplugged");
    Ok(())
}

#[test]
fn what_has_not_happened_is_missing() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments { real_time: false, record: None, plot: None };
    let outcome = run::run(&arguments, &mut std::io::sink())?;
    assert_eq!(outcome.missing(), [] as [String; 0]);
    let lines = outcome.lines.iter().filter(|line| line.event != "stop started").cloned().collect();
    let without = Outcome { lines, ..outcome };
    assert_eq!(without.missing(), ["command stop started"]);
    let moving = Outcome { speed_while_held: 0.1, distance_from_end: 0.1, ..without };
    assert_eq!(moving.missing().len(), 3);
    let unseen = Outcome { compared: 0, ..moving };
    assert_eq!(unseen.missing().last().map(String::as_str), Some("estimates of the tip that were compared"));
    Ok(())
}
