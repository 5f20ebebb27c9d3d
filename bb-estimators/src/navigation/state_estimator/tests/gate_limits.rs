//! The limits of the spoof gate, from both sides.

use super::flight::{FRAME, SECOND, STEP};
use super::*;
use crate::navigation::Refusal;
use nalgebra::{Matrix6, Vector3};

/// Spoofed from 5 s to 6 s, and stable since then.
const STABLE_NS: i64 = 6 * SECOND;

/// A flight with a camera and anchors until the receiver is stable, and then with the camera alone, up to a time between two of its
/// frames.
fn flown(flight: &Flight, strategy: StrategyKind, until_ns: i64) -> Estimator {
    let mut estimator = started(flight, strategy);
    advance(flight, &mut estimator, 0, until_ns);
    assert_eq!(count(estimator.sink(), "rejected"), 0, "there was no fix");
    estimator
}

/// Applies what happens after one time, up to another.
fn advance(flight: &Flight, estimator: &mut Estimator, from_ns: i64, until_ns: i64) {
    for sent in flight.sent(true, true, true) {
        let time_ns = sent.time_ns();
        if !(from_ns + 1..=until_ns).contains(&time_ns) {
            continue;
        }
        match sent {
            Sent::Fix(_) => {}
            Sent::Anchor(_) if time_ns > STABLE_NS => {}
            Sent::Health(reading) if (5 * SECOND..STABLE_NS).contains(&time_ns) => {
                ignore(estimator.add_gps_health(GpsHealthReading { health: GpsHealth::Spoofed, ..reading }));
            }
            sent => ignore(sent.to(estimator)),
        }
    }
}

/// A fix this far east of the present estimate.
fn fix(flight: &Flight, estimator: &mut Estimator, time_ns: i64, off_m: f64) -> Rejection {
    let estimate = flight.frame.position(&estimator.predicted(time_ns).unwrap().position);
    let position = flight.frame.geodetic(&(estimate + Vector3::x() * off_m));
    let refused = estimator.add_gnss(GnssReading { time_ns, position, velocity: None, ..flight.fixes[0] });
    match refused {
        Err(EstimatorError::Degraded(Reason::Gate(rejection))) => rejection,
        other => panic!("{other:?}"),
    }
}

/// An anchor this far east of the present estimate.
fn anchor(flight: &Flight, estimator: &mut Estimator, time_ns: i64, off_m: f64) -> Result<Added, EstimatorError> {
    let output = estimator.predicted(time_ns).unwrap();
    let estimate = flight.frame.position(&output.position);
    estimator.add_pose_anchor(PoseAnchor {
        time_ns,
        position: flight.frame.geodetic(&(estimate + Vector3::x() * off_m)),
        world_from_body: output.world_from_body,
        covariance: Matrix6::identity(),
        ..flight.anchors[0]
    })
}

#[test]
fn ten_seconds_of_dwell() {
    let flight = Flight::new(20, 5);
    for strategy in StrategyKind::ALL {
        for (after_ns, expected) in [
            (9 * SECOND, "dwelling"),
            (10 * SECOND - STEP, "dwelling"),
            (10 * SECOND + STEP, "open"),
            (11 * SECOND, "open"),
        ] {
            // The report that ends the dwell comes at 16 s, and a fix asks as well.
            let time_ns = STABLE_NS + after_ns;
            let mut estimator = flown(&flight, *strategy, time_ns);
            let rejection = fix(&flight, &mut estimator, time_ns, 0.0);
            assert_eq!(matches!(rejection, Rejection::Dwelling { .. }), expected == "dwelling", "{rejection:?}");
            if expected == "open" {
                advance(&flight, &mut estimator, time_ns, time_ns + STEP);
                anchor(&flight, &mut estimator, time_ns + STEP, 0.0).unwrap();
            } else {
                // A sample later the dwell may be over.
                anchor(&flight, &mut estimator, time_ns, 0.0).unwrap();
            }
            assert_eq!(estimator.health().gate.name(), expected, "{}, {after_ns}", strategy.name());
        }
    }
}

#[test]
fn two_hundred_metres_from_the_estimate() {
    let flight = Flight::new(20, 5);
    for strategy in StrategyKind::ALL {
        let time_ns = STABLE_NS + 11 * SECOND + STEP;
        for (off_m, is_far) in [(199.99, false), (200.1, true)] {
            let mut estimator = flown(&flight, *strategy, time_ns);
            match fix(&flight, &mut estimator, time_ns, off_m) {
                Rejection::AwaitsAnchor => assert!(!is_far, "{off_m}"),
                Rejection::TooFar { distance_m } => {
                    assert!(is_far && (distance_m - off_m).abs() < 0.01, "{distance_m}");
                }
                other => panic!("{other:?}"),
            }
            // A rejected one restarts the dwell.
            let gate = estimator.health().gate;
            let expected = if is_far { GateState::Dwelling { since_ns: time_ns } } else { GateState::AwaitsAnchor };
            assert_eq!(gate, expected, "{}", strategy.name());
        }
    }
}

#[test]
fn twenty_five_metres_from_the_anchor() {
    let flight = Flight::new(20, 5);
    for strategy in StrategyKind::ALL {
        let time_ns = STABLE_NS + 11 * SECOND + STEP;
        for (off_m, is_open) in [(24.99, true), (25.1, false), (-24.99, true), (-25.1, false)] {
            let mut estimator = flown(&flight, *strategy, time_ns);
            assert_eq!(fix(&flight, &mut estimator, time_ns, off_m), Rejection::AwaitsAnchor);
            let anchor_ns = time_ns + STEP;
            advance(&flight, &mut estimator, time_ns, anchor_ns);
            anchor(&flight, &mut estimator, anchor_ns, 0.0).unwrap();
            let expected = if is_open { GateState::Open } else { GateState::Dwelling { since_ns: anchor_ns } };
            assert_eq!(estimator.health().gate, expected, "{}, {off_m} m", strategy.name());
            let disagrees = kinds(estimator.sink(), "rejected").filter_map(|event| match event.kind {
                EventKind::Rejected { rejection: Rejection::Disagrees { distance_m } } => Some(distance_m),
                _ => None,
            });
            let disagrees: Vec<f64> = disagrees.collect();
            assert_eq!(disagrees.len(), usize::from(!is_open), "{}", strategy.name());
            assert!(disagrees.iter().all(|distance_m| (distance_m - off_m.abs()).abs() < 0.01), "{disagrees:?}");
        }
    }
}

/// An anchor is compared with a fix of the last two seconds. Without one, it decides nothing.
#[test]
fn a_fix_that_is_two_seconds_old() {
    let flight = Flight::new(22, 5);
    for strategy in StrategyKind::ALL {
        let time_ns = STABLE_NS + 11 * SECOND + STEP;
        for (apart_ns, expected) in [(2 * SECOND, "open"), (2 * SECOND + STEP, "awaits_anchor")] {
            let mut estimator = flown(&flight, *strategy, time_ns);
            assert_eq!(fix(&flight, &mut estimator, time_ns, 0.0), Rejection::AwaitsAnchor);
            advance(&flight, &mut estimator, time_ns, time_ns + apart_ns);
            anchor(&flight, &mut estimator, time_ns + apart_ns, 0.0).unwrap();
            assert_eq!(estimator.health().gate.name(), expected, "{}, {apart_ns}", strategy.name());
            assert_eq!(count(estimator.sink(), "rejected"), 1, "the fix alone");
        }
    }
}

/// An outlier that happens to agree with the fix, or is sent by the spoofer: it is not in the estimate, and opens nothing.
#[test]
fn an_anchor_that_is_refused_does_not_let_the_receiver_in() {
    let flight = Flight::new(20, 5);
    for strategy in StrategyKind::ALL {
        let time_ns = STABLE_NS + 11 * SECOND + STEP;
        let mut estimator = flown(&flight, *strategy, time_ns);
        assert_eq!(fix(&flight, &mut estimator, time_ns, 60.0), Rejection::AwaitsAnchor);
        let mut now_ns = time_ns;
        for _ in 0..3 {
            advance(&flight, &mut estimator, now_ns, now_ns + 3 * FRAME);
            now_ns += 3 * FRAME;
            let refused = anchor(&flight, &mut estimator, now_ns, 60.0).unwrap_err();
            assert!(matches!(refused.reason(), Reason::Refused(Refusal::Gate { .. })), "{refused:?}");
            assert_eq!(estimator.health().gate, GateState::AwaitsAnchor, "{}", strategy.name());
        }
        assert!(
            !kinds(estimator.sink(), "gate")
                .any(|event| { matches!(event.kind, EventKind::Gate { to: GateState::Open, .. }) })
        );
        // A right one shows that the fix is wrong.
        advance(&flight, &mut estimator, now_ns, now_ns + STEP);
        anchor(&flight, &mut estimator, now_ns + STEP, 0.0).unwrap();
        assert_eq!(estimator.health().gate.name(), "dwelling", "{}", strategy.name());
    }
}

/// Fixes were where the estimate had been. Anchors that agree move the estimate elsewhere, and the next one fits it: that says nothing of
/// the fixes.
#[test]
fn anchors_that_overrule_the_estimate_do_not_let_a_fix_from_before_in() {
    let flight = Flight::new(42, 5);
    for strategy in StrategyKind::ALL {
        let mut now_ns = STABLE_NS + 11 * SECOND + STEP;
        let mut estimator = flown(&flight, *strategy, now_ns);
        let mut moved_ns = None;
        while moved_ns.is_none_or(|moved_ns| now_ns < moved_ns + 10 * FRAME) && now_ns < 41 * SECOND {
            if moved_ns.is_none() {
                assert_eq!(fix(&flight, &mut estimator, now_ns, 0.0), Rejection::AwaitsAnchor);
            }
            advance(&flight, &mut estimator, now_ns, now_ns + 2 * FRAME);
            now_ns += 2 * FRAME;
            let away = Vector3::x() * 1000.0;
            let position = flight.frame.geodetic(&(Flight::truth(now_ns).position + away));
            let anchor = PoseAnchor {
                time_ns: now_ns,
                position,
                world_from_body: Flight::truth(now_ns).world_from_body,
                covariance: Matrix6::identity(),
                ..flight.anchors[0]
            };
            let added = estimator.add_pose_anchor(anchor);
            if added.is_err_and(|error| matches!(error.reason(), Reason::Overruled { .. })) {
                moved_ns = Some(now_ns);
            }
        }
        assert!(moved_ns.is_some(), "{}", strategy.name());
        assert!(!estimator.health().gate.is_open(), "{}: {:?}", strategy.name(), estimator.health().gate);
    }
}
