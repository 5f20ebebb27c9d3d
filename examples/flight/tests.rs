//! The flight happens as it is told, with both strategies, and its recorder holds it.

use crate::drone::fly;
use crate::timeline::{Happened, missing};
use bb_estimators::navigation::state_estimator::{FlightEvents, Level};
use bb_mcap::Recording;
use std::error::Error;

#[test]
fn both_strategies_fly() -> Result<(), Box<dyn Error>> {
    for strategy in ["smoother", "eskf"] {
        let file = std::env::temp_dir().join(format!("flight-{strategy}-{}.mcap", std::process::id()));
        let outcome = fly(strategy, Some(&file))?;
        assert_eq!(missing(&outcome.happened), None, "{strategy}: {:#?}", outcome.timeline());
        assert!(outcome.worst_m() < 30.0, "{strategy}: {} m", outcome.worst_m());
        assert!(outcome.grows_while_dead_reckoning(), "{strategy}");
        assert!(outcome.is_gate_open(), "{strategy}");
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
