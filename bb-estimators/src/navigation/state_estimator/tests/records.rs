//! The requirements of recorder and logs.

use super::*;
use uuid::Uuid;

/// A flight with every kind of fault.
fn bad_day(strategy: StrategyKind) -> Estimator {
    let flight = Flight::new(30, 4);
    let mut estimator = started(&flight, strategy);
    fly(&mut estimator, &flight.sent(true, true, true), |sent| match (sent, sent.time_ns() / SECOND) {
        (Sent::Imu(_), 20..24) | (Sent::Vio(_), 10..14) => None,
        (Sent::Anchor(_), 6) => Some(flight.moving(sent, Vector3::x() * 90.0)),
        (_, 8) => Some(sent.reporting(GpsHealth::Spoofed)),
        _ => Some(*sent),
    });
    estimator
}

#[test]
fn every_input_is_an_event() {
    for (_, flight, mut estimator) in flights(5, 4) {
        for sent in &flight.sent(true, true, true) {
            let before = estimator.sink().len();
            let result = sent.to(&mut estimator);
            let events = &estimator.sink()[before..];
            let reasons: Vec<_> = events
                .iter()
                .filter_map(|event| match event.kind {
                    EventKind::Added { .. } => Some(None),
                    EventKind::Degraded { reason, .. } | EventKind::Fatal { reason, .. } => Some(Some(reason)),
                    EventKind::Rejected { rejection } => Some(Some(Reason::Gate(rejection))),
                    _ => None,
                })
                .collect();
            let is_told = reasons.contains(&result.err().map(|error| error.reason()));
            assert!(is_told, "{sent:?}, {result:?}: {events:?}");
        }
        let added = |input| {
            let is_it =
                |event: &&Event| matches!(event.kind, EventKind::Added { input: this, .. } if this == input);
            estimator.sink().iter().filter(is_it).count()
        };
        assert_eq!((added(InputKind::Vio), added(InputKind::Anchor), added(InputKind::Imu)), (50, 4, 1000));
        let broken = VioOutput { translation: Vector3::repeat(f64::NAN), ..flight.vio[40] };
        assert_eq!(estimator.add_vio(broken), degraded(Refusal::NonFinite));
        let expected = EventKind::Degraded { input: InputKind::Vio, reason: Reason::Refused(Refusal::NonFinite) };
        assert_eq!(estimator.sink().last().unwrap().kind, expected);
    }
}

#[test]
fn levels_are_those_of_the_design() {
    for strategy in StrategyKind::ALL {
        let estimator = bad_day(*strategy);
        let is_blocking = |event: &Event| matches!(event.kind, EventKind::Gate { to: GateState::Blocked, .. });
        let expected = |event: &Event| match event.kind.name() {
            "fatal" | "fallback_imminent" | "fallback_engaged" => Level::Error,
            "degraded" | "rejected" | "covariance_growing" => Level::Warn,
            "gate" if is_blocking(event) => Level::Warn,
            "ready" | "started" | "gate" | "label" | "revised" | "fallback_recovered" => Level::Info,
            "added" | "emitted" | "keyframe" => Level::Debug,
            other => panic!("{other}"),
        };
        for event in estimator.sink() {
            assert_eq!(event.level(), expected(event), "{event:?}");
            let Some(text) = event.status_text() else { continue };
            assert!((10..50).contains(&text.as_str().len()) && text.as_str().starts_with("NAV "), "{text}");
        }
        assert_eq!(estimator.sink().iter().filter(|event| is_blocking(event)).count(), 1, "{strategy:?}");
        let inputs = ["ready", "started", "added", "degraded", "rejected", "label", "gate", "keyframe", "emitted"];
        let fallback = ["fallback_imminent", "fallback_engaged", "fallback_recovered"];
        for name in inputs.iter().chain(&fallback) {
            assert!(count(estimator.sink(), name) > 0, "{strategy:?}: no {name}");
        }
    }
}

/// [`StatusText`] cuts what is longer.
#[test]
fn status_texts_of_what_rarely_happens() {
    let rejection = Rejection::Disagrees { distance_m: 123.4 };
    for (kind, expected) in [
        (EventKind::Rejected { rejection }, "NAV GPS rejected: anchor 123 m off"),
        (EventKind::CovarianceGrowing { ratio: 2.5 }, "NAV covariance 2.5 times steady"),
        (EventKind::FallbackImminent, "NAV no estimate: fallback imminent"),
        (
            EventKind::Fatal { input: InputKind::WarmStart, reason: Reason::Overflow },
            "NAV fatal: no estimate (warm_start)",
        ),
    ] {
        let event = Event { time_ns: 0, frame_id: Uuid::nil(), spoof_block: false, kind };
        assert_eq!(event.status_text().unwrap().as_str(), expected);
    }
}

/// The window restarts after a gap that is too long to be bridged, and on a clock that was set back.
#[test]
fn a_recorder_has_every_keyframe_before_a_restart() {
    let flight = Flight::new(10, 3);
    for (strategy, behind_ns) in
        StrategyKind::ALL.iter().flat_map(|one| [(one, -100 * SECOND), (one, 100 * SECOND)])
    {
        let mut estimator = started(&flight, *strategy);
        for sent in &flight.sent(true, true, false) {
            let behind_ns = if sent.time_ns() > 5 * SECOND { behind_ns } else { 0 };
            ignore(sent.behind(behind_ns).to(&mut estimator));
        }
        let newest_ns = estimator.current_estimate().unwrap().time_ns;
        estimator.finish();
        let estimates = keyframes(estimator.sink());
        let times: Vec<i64> = estimates.iter().map(|estimate| estimate.time_ns).collect();
        let what = std::format!("{strategy:?}, {behind_ns}: {times:?}");
        let (before, after) = times.split_at(51);
        assert_eq!(before, (0..=50).map(|i| i * FRAME).collect::<Vec<_>>(), "{what}");
        assert!(after.is_sorted_by(|a, b| a < b) && after.len() > 20, "{what}");
        assert_eq!(after.last(), Some(&newest_ns), "{what}");
        assert!(estimates[..51].iter().all(|estimate| flight.error(estimate).0 < 3.0), "{what}");
    }
}

/// Keyframes that have left the window, of any size, and at the end of a flight those that are still in it.
#[test]
fn keyframes_go_to_the_recorder_once_and_in_order() {
    let flight = Flight::new(12, 3);
    for (strategy, window) in each([2, 6, 15, 40]) {
        let what = std::format!("{strategy:?}, {window}");
        let mut estimator = started_with(&flight, strategy, |params| params.window = window);
        let flown = fly(&mut estimator, &flight.sent(true, true, false), |sent| *sent);
        let is_smoothed = flown.iter().filter_map(|flown| flown.output).any(|output| output.smoothed);
        assert!(!is_smoothed && flown.iter().all(|flown| flown.result.is_ok()), "only the forward estimate leaves");
        let held = estimator.health().keyframes as i64;
        // The smoother's window restarts when another copy of the filter becomes the best, here last at 10.3 s.
        assert_eq!(held, i64::from(if strategy.is_smoothing() { window.min(18) } else { window }), "{what}");
        let times = |of: &[EstimatorOutput]| of.iter().map(|one| one.time_ns).collect::<Vec<_>>();
        let frames = |range: core::ops::RangeInclusive<i64>| range.map(|i| i * FRAME).collect::<Vec<_>>();
        let mut history = times(&estimator.smoothed_history(1000));
        history.reverse();
        assert_eq!(history, frames(121 - held..=119), "{what}");
        let left = keyframes(estimator.sink());
        assert_eq!(times(&left), frames(0..=120 - held), "{what}");
        assert!(left.iter().all(|estimate| estimate.smoothed == strategy.is_smoothing()), "{what}");
        assert!(left[20..].iter().all(|estimate| flight.error(estimate).0 < 3.0), "{what}");
        estimator.finish();
        assert_eq!(times(&keyframes(estimator.sink())), frames(0..=120), "{what}");
    }
}

/// Each estimate comes with an event of its id, the inputs since the one before, and the depth of the window.
#[test]
fn an_estimate_says_what_was_added() {
    for (strategy, flight, mut estimator) in flights(8, 4) {
        let flown = fly(&mut estimator, &flight.sent(true, true, false), |sent| *sent);
        let ids: Vec<_> = flown.iter().filter_map(|flown| flown.output).map(|output| output.frame_id).collect();
        let last_ns = kinds(estimator.sink(), "emitted").last().unwrap().time_ns;
        let is_added = |event: &&Event, wanted: InputKind| {
            let EventKind::Added { input, waits, .. } = event.kind else { return false };
            input == wanted && !waits && event.time_ns <= last_ns
        };
        let added = |input| estimator.sink().iter().filter(|event| is_added(event, input)).count() as u32;
        let expected = [InputKind::Imu, InputKind::Vio, InputKind::Anchor].map(added);
        let (mut sums, mut deepest) = ([0; 3], 0);
        for (event, id) in kinds(estimator.sink(), "emitted").zip(&ids) {
            let EventKind::Emitted { imu, vio, poses, smoothed } = event.kind else { unreachable!() };
            assert_eq!(event.frame_id, *id);
            sums = [sums[0] + imu, sums[1] + vio, sums[2] + poses];
            deepest = deepest.max(smoothed);
        }
        assert_eq!((sums, deepest), (expected, 15), "{strategy:?}");
    }
}

#[test]
fn a_recorder_that_is_not_wanted_costs_nothing() {
    let flight = Flight::new(4, 4);
    for strategy in StrategyKind::ALL {
        let mut estimator = started_with(&flight, *strategy, |params| params.record_keyframes = false);
        flight.sent(true, true, false).iter().for_each(|sent| sent.to(&mut estimator).unwrap());
        assert_eq!(count(estimator.sink(), "keyframe"), 0);
        assert_eq!(estimator.current_estimate().unwrap().time_ns, 4 * SECOND);
    }
}
