//! The flight has the events of its description, with both strategies, and so has its recording.

use crate::drone::{fly, fly_recorded};
use crate::expected::Expected;
use crate::missing_recorded;
use crate::recorded::Recorded;
use crate::timeline::{Happened, missing, unexpected};
use bb_estimators::navigation::state_estimator::{FlightEvents, Level};
use bb_mcap::Recording;
use std::error::Error;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;

#[test]
fn both_strategies_fly() -> Result<(), Box<dyn Error>> {
    for strategy in ["smoother", "eskf"] {
        let file = std::env::temp_dir().join(format!("flight-{strategy}-{}.mcap", std::process::id()));
        let outcome = fly(strategy, Some(&file))?;
        assert_eq!(missing(&outcome.happened), None, "{strategy}: {:#?}", outcome.timeline());
        assert!(outcome.worst_m() < 30.0, "{strategy}: {} m", outcome.worst_m());
        assert!(outcome.grows_while_dead_reckoning(), "{strategy}");
        assert!(outcome.is_gate_open() && outcome.is_fixed_after(73.0), "{strategy}");
        assert!(!outcome.is_fixed_after(60.0), "{strategy}: it is not let in before");
        assert_eq!(unexpected(&outcome.happened), None, "{strategy}");
        let (mut keyframes, mut severe) = (0, 0);
        for message in Recording::open(&file)?.messages::<FlightEvents>("estimator/base/navigation/events")? {
            for event in &message?.events {
                keyframes += usize::from(event.keyframe.is_some());
                severe += usize::from(event.level <= Level::Warn);
            }
        }
        std::fs::remove_file(&file)?;
        let told = outcome.happened.iter().filter(|one| one.what.starts_with("rejected")).count();
        assert!(keyframes == outcome.keyframes && keyframes > 700, "{keyframes} keyframes left the window");
        assert!(severe >= told && told > 200, "{severe} of {told}");
    }
    Ok(())
}

#[test]
fn a_flight_in_which_something_is_missing_fails() {
    let happened = Happened { time_s: 1.2, what: "started from origin".into() };
    assert_eq!(missing(&[happened]), Some("label satellite_anchored, from 1 s to 3 s".into()));
}

#[test]
fn a_receiver_that_is_let_in_too_early_fails() {
    for (time_s, what) in
        [(65.0, "gate open"), (71.0, "gate blocked"), (80.0, "fatal imu: a gap"), (5.0, "started from anchor")]
    {
        let happened = Happened { time_s, what: what.into() };
        assert_eq!(unexpected(&[happened]), Some(format!("a flight without `{what}` at {time_s:.2} s")));
    }
    let usual = [(20.1, "gate blocked"), (72.4, "gate open"), (30.0, "rejected the receiver was spoofed")];
    let happened = usual.map(|(time_s, what)| Happened { time_s, what: what.into() });
    assert_eq!(unexpected(&happened), None);
}

fn recorded(name: &str) -> Result<Arc<Recorded>, Box<dyn Error>> {
    Ok(Arc::new(Recorded::read(&bb_tests::recordings::navigation()?.join(name))?))
}

/// A recorded flight has the labels that follow from it: its camera is blind for five seconds, anchors are up to nine
/// seconds apart, and some are of another place.
#[test]
#[ignore = "needs recordings: .ci/run runs it"]
fn a_recorded_flight_has_the_labels_that_follow_from_it() -> Result<(), Box<dyn Error>> {
    let flight = recorded("simflight_stress")?;
    let outcome = fly_recorded("eskf", &flight, None)?;
    assert_eq!(missing_recorded(&outcome, &flight), None, "{:#?}", outcome.timeline());
    assert!(outcome.worst_m() < 15.0, "{} m", outcome.worst_m());
    for label in ["dead_reckoned", "visual_propagated", "satellite_anchored"] {
        let happened = outcome.happened.iter().any(|one| one.what == format!("label {label}"));
        // It begins with the first.
        assert!(happened, "{label}");
    }
    // A camera that saw all the time is not what was recorded.
    let seeing = Expected::of(&flight).without_breaks();
    assert!(seeing.fault(outcome.labels()).is_some_and(|fault| fault.contains("dead_reckoned")));
    Ok(())
}

#[test]
#[ignore = "needs recordings: .ci/run runs it"]
fn every_recorded_flight_has_the_labels_that_follow_from_it() -> Result<(), Box<dyn Error>> {
    for name in ["simflight", "simflight_stress", "euroc_mh01"] {
        let flight = recorded(name)?;
        for strategy in ["smoother", "eskf"] {
            let outcome = fly_recorded(strategy, &flight, None)?;
            assert_eq!(missing_recorded(&outcome, &flight), None, "{name}, {strategy}: {:#?}", outcome.timeline());
            assert!(outcome.worst_m() < 15.0, "{name}, {strategy}: {} m", outcome.worst_m());
        }
    }
    Ok(())
}

const FILE: &str = "FLIGHT_TEST_FILE";
const STRATEGY: &str = "FLIGHT_TEST_STRATEGY";

/// Process that is killed: it flies and records.
#[test]
fn child() {
    let (Ok(file), Ok(strategy)) = (std::env::var(FILE), std::env::var(STRATEGY)) else { return };
    fly(&strategy, Some(Path::new(&file))).expect("it flies until it is killed");
}

/// The flight-data recorder of a process that was killed in the middle of it holds all up to the last chunk that was written, in order.
#[test]
fn the_recorder_of_a_killed_flight_can_be_read() -> Result<(), Box<dyn Error>> {
    let mut least = 100_000;
    for (round, strategy) in ["smoother", "eskf"].into_iter().enumerate() {
        let file = std::env::temp_dir().join(format!("flight-killed-{round}-{}.mcap", std::process::id()));
        let mut child = Command::new(std::env::current_exe()?)
            .args(["--exact", "tests::child"])
            .env(FILE, &file)
            .env(STRATEGY, strategy)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()?;
        while std::fs::metadata(&file).map_or(0, |data| data.len()) < least {
            assert!(child.try_wait()?.is_none(), "it flies on");
            std::thread::yield_now();
        }
        child.kill()?;
        child.wait()?;
        let recording = Recording::open(&file)?;
        assert!(recording.broken().is_some(), "it was killed in the middle");
        let (mut kinds, mut keyframes) = (Vec::new(), Vec::new());
        for message in recording.messages::<FlightEvents>("estimator/base/navigation/events")? {
            // The last may be cut.
            let Ok(message) = message else { break };
            for event in &message.events {
                kinds.push(event.kind.clone());
                keyframes.extend(event.keyframe.as_ref().map(|keyframe| keyframe.time.as_nanos()));
            }
        }
        std::fs::remove_file(&file)?;
        assert_eq!(kinds[0], "ready");
        assert_eq!(kinds.iter().filter(|kind| *kind == "started").count(), 1);
        assert!(keyframes.len() > 50 * (round + 1), "{} keyframes", keyframes.len());
        assert!(keyframes.windows(2).all(|two| two[0] < two[1]), "in order, each once");
        least *= 3;
    }
    Ok(())
}
