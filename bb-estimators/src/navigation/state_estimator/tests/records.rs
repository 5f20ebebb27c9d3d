//! The requirements of recorder and logs.

use super::flight::{FRAME, SECOND};
use super::*;
use crate::navigation::Refusal;
use nalgebra::Vector3;
use uuid::Uuid;

/// A flight with every kind of fault.
fn bad_day(strategy: StrategyKind) -> Estimator {
    let flight = Flight::new(30, 4);
    let mut estimator = started(&flight, strategy);
    for sent in &flight.sent(true, true, true) {
        let time_ns = sent.time_ns();
        let second = time_ns / SECOND;
        let _ = match sent {
            Sent::Imu(_) if (20..24).contains(&second) => Ok(()),
            Sent::Vio(_) if (10..14).contains(&second) => Ok(()),
            Sent::Anchor(anchor) if second == 6 => {
                let moved = flight.frame.position(&anchor.position) + Vector3::new(90.0, 0.0, 0.0);
                let outlier = PoseAnchor { position: flight.frame.geodetic(&moved), ..*anchor };
                estimator.add_pose_anchor(outlier).map(drop)
            }
            Sent::Health(reading) if second == 8 => {
                estimator.add_gps_health(GpsHealthReading { health: GpsHealth::Spoofed, ..*reading }).map(drop)
            }
            sent => sent.to(&mut estimator),
        };
        estimator.tick(time_ns);
    }
    estimator
}

#[test]
fn every_input_is_an_event() {
    let flight = Flight::new(5, 4);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
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
            assert!(
                reasons.contains(&result.err().map(|error| error.reason())),
                "{sent:?}, {result:?}: {events:?}"
            );
        }
        let added = |input| {
            let is_it =
                |event: &&Event| matches!(event.kind, EventKind::Added { input: this, .. } if this == input);
            estimator.sink().iter().filter(is_it).count()
        };
        assert_eq!((added(InputKind::Vio), added(InputKind::Anchor), added(InputKind::Imu)), (50, 4, 1000));
        let broken = VioOutput { translation: Vector3::repeat(f64::NAN), ..flight.vio[40] };
        assert_eq!(estimator.add_vio(broken), Err(EstimatorError::Degraded(Reason::Refused(Refusal::NonFinite))));
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
        }
        assert_eq!(estimator.sink().iter().filter(|event| is_blocking(event)).count(), 1, "{}", strategy.name());
        let seen = |name: &str| count(estimator.sink(), name) > 0;
        for name in
            ["ready", "started", "added", "degraded", "rejected", "label", "gate", "keyframe", "fallback_engaged"]
        {
            assert!(seen(name), "{}: no {name}", strategy.name());
        }
    }
}

#[test]
fn status_texts_have_at_most_fifty_characters() {
    let huge = f64::MAX;
    let rejections = [
        Rejection::Unhealthy,
        Rejection::Spoofed,
        Rejection::Dwelling { seconds: huge },
        Rejection::AwaitsAnchor,
        Rejection::TooFar { distance_m: huge },
        Rejection::Disagrees { distance_m: huge },
    ];
    let event = |kind| Event { time_ns: 0, frame_id: Uuid::nil(), spoof_block: false, kind };
    let texts = rejections.map(|rejection| EventKind::Rejected { rejection }).into_iter().chain([
        EventKind::CovarianceGrowing { ratio: huge },
        EventKind::FallbackImminent,
        EventKind::FallbackEngaged,
        EventKind::FallbackRecovered,
        EventKind::Started { from: StartedFrom::FlightController },
        EventKind::Label { from: SourceLabel::DeadReckoned, to: SourceLabel::SatelliteAnchored },
        EventKind::Gate { from: GateState::Open, to: GateState::AwaitsAnchor },
        EventKind::Fatal { input: InputKind::WarmStart, reason: Reason::Overflow },
    ]);
    for kind in texts {
        let text = event(kind).status_text().unwrap();
        assert!((10..=50).contains(&text.as_str().len()) && text.as_str().starts_with("NAV "), "{text}");
    }
    // Texts with typical numbers are not truncated.
    let usual = EventKind::Rejected { rejection: Rejection::Disagrees { distance_m: 123.4 } };
    assert_eq!(event(usual).status_text().unwrap().as_str(), "NAV GPS rejected: anchor 123 m off");
}

/// Keyframes that are still in the window follow, at the end of a flight, those that have left it.
#[test]
fn a_recorder_has_every_keyframe_at_the_end() {
    let flight = Flight::new(6, 3);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        flight.sent(true, true, false).iter().for_each(|sent| ignore(sent.to(&mut estimator)));
        let newest_ns = estimator.current_estimate().unwrap().time_ns;
        estimator.finish();
        let times: Vec<i64> = kinds(estimator.sink(), "keyframe").map(|event| event.time_ns).collect();
        let expected: Vec<i64> = (0..=newest_ns / FRAME).map(|i| i * FRAME).collect();
        assert_eq!(times, expected, "{}", strategy.name());
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
        let estimates = kinds(estimator.sink(), "keyframe").map(|event| match event.kind {
            EventKind::Keyframe { estimate } => estimate,
            _ => unreachable!(),
        });
        let estimates: Vec<_> = estimates.collect();
        let times: Vec<i64> = estimates.iter().map(|estimate| estimate.time_ns).collect();
        let what = std::format!("{}, {behind_ns}: {times:?}", strategy.name());
        let (before, after) = times.split_at(51);
        assert_eq!(before, (0..=50).map(|i| i * FRAME).collect::<Vec<_>>(), "{what}");
        assert!(after.is_sorted_by(|a, b| a < b) && after.len() > 20, "{what}");
        assert_eq!(after.last(), Some(&newest_ns), "{what}");
        assert!(estimates[..51].iter().all(|estimate| flight.error(estimate).0 < 3.0), "{what}");
    }
}

#[test]
fn keyframes_that_leave_the_window_go_to_the_recorder_once_and_in_order() {
    let flight = Flight::new(8, 4);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        let sent = flight.sent(true, true, false);
        for sent in &sent {
            sent.to(&mut estimator).unwrap();
            if let Sent::Imu(sample) = sent
                && let Some(output) = estimator.tick(sample.time_ns)
            {
                assert!(!output.smoothed, "only the forward estimate leaves");
            }
        }
        let left: Vec<_> = kinds(estimator.sink(), "keyframe")
            .map(|event| match event.kind {
                EventKind::Keyframe { estimate } => estimate,
                _ => unreachable!(),
            })
            .collect();
        let times: Vec<i64> = left.iter().map(|estimate| estimate.time_ns).collect();
        // From the start to the fifteenth keyframe before the newest.
        let expected: Vec<i64> = (0..=80 - 15).map(|i| i * FRAME).collect();
        assert_eq!(times, expected);
        assert!(left.iter().all(|estimate| estimate.smoothed == strategy.is_smoothing()));
        assert!(left[20..].iter().all(|estimate| flight.error(estimate).0 < 3.0));
    }
}

/// Each estimate comes with an event of its id, the inputs since the one before, and the depth of the window.
#[test]
fn an_estimate_says_what_was_added() {
    let flight = Flight::new(8, 4);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        let mut ids = Vec::new();
        for sent in &flight.sent(true, true, false) {
            sent.to(&mut estimator).unwrap();
            if let Sent::Imu(sample) = sent {
                ids.extend(estimator.tick(sample.time_ns).map(|output| output.frame_id));
            }
        }
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
        assert_eq!((sums, deepest), (expected, 15), "{}", strategy.name());
    }
}

#[test]
fn a_recorder_that_is_not_wanted_costs_nothing() {
    let flight = Flight::new(4, 4);
    for strategy in StrategyKind::ALL {
        let mut config = config(*strategy);
        config.params.record_keyframes = false;
        let mut estimator = FlightNavigator::new(config, Events::new()).unwrap();
        estimator.warm_start(flight.warm_start(0)).unwrap();
        flight.sent(true, true, false).iter().for_each(|sent| sent.to(&mut estimator).unwrap());
        assert_eq!(count(estimator.sink(), "keyframe"), 0);
        assert_eq!(estimator.current_estimate().unwrap().time_ns, 4 * SECOND);
    }
}
