//! The requirements of the spoof gate, and its limits from both sides.

use super::*;

/// Reasons for which a receiver that is not let in yet was refused, in the order of [`Scenario::rejected`].
fn cause(event: &Event) -> usize {
    match event.kind {
        EventKind::Rejected { rejection: Rejection::Unhealthy } => 0,
        EventKind::Rejected { rejection: Rejection::Spoofed } => 1,
        EventKind::Rejected { rejection: Rejection::TooFar { .. } } => 2,
        EventKind::Rejected { rejection: Rejection::Dwelling { .. } } => 3,
        EventKind::Rejected { rejection: Rejection::AwaitsAnchor } => 4,
        EventKind::Rejected { rejection: Rejection::Disagrees { .. } } => 5,
        other => panic!("{other:?}"),
    }
}

/// The receiver and the anchors in a flight of 40 s with a camera, by the second, and what becomes of them.
#[derive(Clone, Copy)]
struct Scenario {
    name: &'static str,
    health: fn(i64) -> GpsHealth,
    /// Offset of the fixes, m.
    off: fn(i64) -> f64,
    /// `true` at the times with anchors.
    anchors: fn(i64) -> bool,
    /// Changes of the gate: times in tenths of a second, and the new states.
    changes: &'static str,
    /// Number of rejections that are unhealthy, spoofed, too far, dwelling, awaiting an anchor, and in disagreement
    /// with one.
    rejected: [usize; 6],
}

fn spoofed_from_5_to_10(second: i64) -> GpsHealth {
    if (5..10).contains(&second) { GpsHealth::Spoofed } else { GpsHealth::Stable }
}

const SCENARIOS: [Scenario; 6] = [
    Scenario {
        // The anchor at 20 s comes 15 ms after the full second.
        name: "spoofed, and then let in after ten seconds by an anchor that agrees",
        health: spoofed_from_5_to_10,
        off: |second| if (5..10).contains(&second) { 150.0 } else { 0.0 },
        anchors: |_| true,
        changes: "50 blocked, 100 dwelling, 200 awaits_anchor, 200 open",
        rejected: [0, 25, 0, 50, 1, 0],
    },
    Scenario {
        name: "without an anchor it stays out",
        health: spoofed_from_5_to_10,
        off: |_| 0.0,
        anchors: |second| !(15..30).contains(&second),
        changes: "50 blocked, 100 dwelling, 200 awaits_anchor, 300 open",
        rejected: [0, 25, 0, 50, 51, 0],
    },
    Scenario {
        name: "a break of the health begins the dwell again",
        health: |second| if second == 15 { GpsHealth::Unstable } else { spoofed_from_5_to_10(second) },
        off: |_| 0.0,
        anchors: |_| true,
        changes: "50 blocked, 100 dwelling, 150 blocked, 160 dwelling, 260 awaits_anchor, 260 open",
        rejected: [0, 30, 0, 75, 1, 0],
    },
    Scenario {
        name: "an anchor that disagrees begins the dwell again: the fixes are 60 m off until 25 s",
        health: spoofed_from_5_to_10,
        off: |second| if (5..25).contains(&second) { 60.0 } else { 0.0 },
        anchors: |_| true,
        changes: "50 blocked, 100 dwelling, 200 awaits_anchor, 200 dwelling, 300 open",
        rejected: [0, 25, 0, 100, 1, 1],
    },
    Scenario {
        name: "a fix beyond the bounded distance begins the dwell again: each one until 18 s",
        health: spoofed_from_5_to_10,
        off: |second| if (5..18).contains(&second) { 250.0 } else { 0.0 },
        anchors: |_| true,
        changes: "50 blocked, 100 dwelling, 278 awaits_anchor, 280 open",
        rejected: [0, 25, 40, 49, 2, 0],
    },
    Scenario {
        name: "unhealthy, spoofed, far off, in disagreement with a rare anchor, and then correct",
        health: |second| match second {
            0..2 => GpsHealth::NoFix,
            5 => GpsHealth::Spoofed,
            _ => GpsHealth::Stable,
        },
        off: |second| match second {
            6..8 => 250.0,
            8..22 => 60.0,
            _ => 0.0,
        },
        anchors: |second| second % 5 == 4,
        changes: "50 blocked, 60 dwelling, 178 awaits_anchor, 190 dwelling, 290 open",
        rejected: [9, 5, 10, 99, 7, 1],
    },
];

#[test]
fn a_receiver_that_was_spoofed_is_let_in_by_an_anchor_after_the_dwell() {
    let flight = Flight::new(40, 5);
    for (strategy, Scenario { name, health, off, anchors, changes, rejected }) in each(SCENARIOS) {
        let what = std::format!("{strategy:?}, {name}");
        let mut estimator = started(&flight, strategy);
        let flown = fly(&mut estimator, &flight.sent(true, true, true), |sent| {
            let second = sent.time_ns() / SECOND;
            match sent {
                Sent::Anchor(_) if !anchors(second) => None,
                Sent::Anchor(_) => Some(*sent),
                sent => Some(flight.moving(&sent.reporting(health(second)), Vector3::x() * off(second))),
            }
        });
        for Flown { sent, result, output, .. } in flown {
            assert!(result.is_ok() || matches!(sent, Sent::Fix(_)), "{what}: {sent:?}: {result:?}");
            let error_m = output.map_or(0.0, |output| flight.error(&output).0);
            assert!(error_m < 5.0, "{what}: spoofing moves nothing, {error_m} m at {}", sent.time_ns());
        }
        let change = |event: &Event| match event.kind {
            EventKind::Gate { to, .. } => std::format!("{} {}", event.time_ns / (SECOND / 10), to.name()),
            _ => unreachable!(),
        };
        let changed: Vec<_> = kinds(estimator.sink(), "gate").map(change).collect();
        assert_eq!(changed.join(", "), changes, "{what}");
        let mut counts = [0; 6];
        for event in kinds(estimator.sink(), "rejected") {
            counts[cause(event)] += 1;
            let text = event.status_text().unwrap();
            assert!(event.level() == Level::Warn && text.as_str().starts_with("NAV GPS "), "{text}");
        }
        assert_eq!(counts, rejected, "{what}");
        assert!(estimator.health().gate.is_open(), "{what}");
    }
}

/// Fixes that are all in another place. A receiver that is alone with the IMU overrules the estimate: a gate that is
/// never overridden would lose the position permanently. Beside a camera it never does, but it degrades the estimate.
#[test]
fn a_receiver_overrules_the_imu_alone_and_never_a_camera() {
    let flight = Flight::new(20, 3);
    let off = Vector3::new(0.0, 300.0, 0.0);
    for (strategy, has_camera) in each([false, true]) {
        let mut estimator = started(&flight, strategy);
        let flown = fly(&mut estimator, &flight.sent(has_camera, false, true), |sent| {
            if sent.time_ns() > 4 * SECOND { flight.moving(sent, off) } else { *sent }
        });
        let outputs: Vec<_> = flown.iter().filter_map(|flown| flown.output).collect();
        let apart_m = |output: &EstimatorOutput| (flight.off(output) - off).norm();
        for output in outputs.iter().filter(|output| output.emitted_ns > 4 * SECOND) {
            let (apart_m, time_ns) = (apart_m(output), output.time_ns);
            let is_told = if has_camera {
                time_ns <= 47 * FRAME || (output.degraded && (280.0..320.0).contains(&apart_m))
            } else {
                time_ns < 45 * FRAME || output.degraded || apart_m < 20.0
            };
            assert!(is_told, "{strategy:?}, camera {has_camera}: {apart_m} m at {time_ns}");
        }
        let last = outputs[outputs.len() - 1];
        assert!(has_camera || (apart_m(&last) < 10.0 && !last.degraded), "{strategy:?}: {last:?}");
    }
}

/// Random fixes contradict one another: none is believed after any number of refusals, and none affects the estimate.
#[test]
fn fixes_and_anchors_that_do_not_agree_overrule_nothing() {
    let flight = Flight::new(80, 3);
    let wild = |sent: &Sent| {
        let i = sent.time_ns() / STEP;
        let (sin, cos) = (i as f64 * 2.4).sin_cos();
        flight.moving(sent, Vector3::new(cos, sin, 0.1) * 3000.0 * (1 + i % 3) as f64)
    };
    for strategy in StrategyKind::ALL {
        // Exactly the random ones are refused.
        for (with_anchors, refused) in [(false, 50), (true, 10)] {
            let mut estimator = started(&flight, *strategy);
            let flown = fly(&mut estimator, &flight.sent(with_anchors, with_anchors, !with_anchors), |sent| {
                if (65 * SECOND..75 * SECOND).contains(&sent.time_ns()) { wild(sent) } else { *sent }
            });
            for output in flown.iter().filter_map(|flown| flown.output) {
                let (error_m, _) = flight.error(&output);
                assert!(error_m < 10.0, "{strategy:?}: {error_m} m at {}", output.time_ns);
            }
            assert_eq!(count(estimator.sink(), "started"), 1);
            let gated = |event: &&Event| match event.kind {
                EventKind::Degraded { reason, .. } => is_gated::<()>(&degraded(reason)),
                _ => false,
            };
            assert_eq!(estimator.sink().iter().filter(gated).count(), refused, "{strategy:?}");
            assert_eq!(count(estimator.sink(), "degraded"), refused, "{strategy:?}");
        }
    }
}

/// The estimate is kilometres off, through a stopped clock or a wrong world, and the fixes agree. The attitude is kept.
#[test]
fn a_receiver_that_is_alone_moves_an_estimate_that_is_kilometres_off() {
    let flight = Flight::new(95, 3);
    let off = Vector3::new(-7000.0, 9000.0, 30.0);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        let flown = fly(&mut estimator, &flight.sent(false, false, true), |sent| {
            if sent.time_ns() > 65 * SECOND { flight.moving(sent, off) } else { *sent }
        });
        let overruled = |event: &Event| match event.kind {
            EventKind::Degraded { reason: Reason::Overruled { nis }, .. } => Some((event.time_ns, nis)),
            _ => None,
        };
        let overruled: Vec<_> = estimator.sink().iter().filter_map(overruled).collect();
        let [(moved_ns, nis)] = overruled[..] else { panic!("{strategy:?}: {overruled:?}") };
        // The first to come 20 s after another that agrees.
        assert!(nis > 1000.0 && (moved_ns - 65 * SECOND) / (SECOND / 5) == 100, "{strategy:?}: {overruled:?}");
        // It is judged with the next sample.
        for output in flown.iter().filter_map(|flown| flown.output).filter(|output| output.time_ns > moved_ns) {
            let (apart_m, turned) = ((flight.off(&output) - off).norm(), flight.error(&output).1);
            assert!(apart_m < 10.0 && turned < 0.05, "{strategy:?}: {apart_m} m, {turned} rad");
        }
        let started: Vec<_> = kinds(estimator.sink(), "started").map(|event| event.kind).collect();
        assert_eq!(started[1..], [EventKind::Started { from: StartedFrom::Receiver }], "once");
        assert_eq!(estimator.predicted(95 * SECOND).map(|output| output.resets), Some(1));
        assert_eq!(estimator.health().state, HealthState::Tracking, "five fixes have confirmed it");
    }
}

/// After a long time without a camera, an anchor moves the estimate far. A fix is compared with the anchor, not with what the anchor
/// has corrected: one that follows the wrong estimate stays out, and one that agrees with the anchor is let in.
#[test]
fn what_an_anchor_corrects_is_no_difference_to_a_fix() {
    let flight = Flight::new(120, 5);
    for (strategy, is_genuine) in each([true, false]) {
        let mut estimator = started(&flight, strategy);
        let mut judged = None;
        for sent in &flight.sent(true, true, true) {
            let time_ns = sent.time_ns();
            let is_blind = time_ns > 10 * SECOND;
            match sent {
                Sent::Health(_) => {
                    sent.reporting(spoofed_from_5_to_10(time_ns / SECOND)).to(&mut estimator).unwrap();
                }
                Sent::Fix(_) if time_ns < 22 * SECOND => {}
                Sent::Fix(fix) => {
                    let estimate = estimator.predicted(time_ns).unwrap();
                    let position = if is_genuine { fix.position } else { estimate.position };
                    let added = estimator.add_gnss(GnssReading { position, ..*fix });
                    assert_eq!(added, Ok(Added::Waits), "it is judged with the next sample");
                }
                Sent::Vio(_) if is_blind => {}
                Sent::Anchor(anchor) if is_blind => {
                    let error_m = flight.off(&estimator.predicted(time_ns).unwrap()).norm();
                    if time_ns > 23 * SECOND && error_m > 40.0 {
                        assert!(error_m < 200.0, "{error_m}");
                        let added = estimator.add_pose_anchor(*anchor).unwrap();
                        assert!(matches!(added, Added::Taken { .. }), "{added:?}");
                        judged = Some(error_m);
                        break;
                    }
                }
                sent => sent.to(&mut estimator).unwrap(),
            }
        }
        let (error_m, gate) = (judged.unwrap(), estimator.health().gate);
        assert_eq!(gate.is_open(), is_genuine, "{strategy:?}, off by {error_m} m: {gate:?}");
    }
}

/// Anchors are positions of the body, and fixes are of the antenna: how they are mounted is no difference between them.
#[test]
fn a_receiver_is_let_in_by_where_its_antenna_puts_the_body() {
    let flight = Flight::new(9, 4);
    // With an arm of 24 m, a fix 40 m too low is 16 m from the body.
    for (arm_m, off_m, is_let_in) in [(60.0, 0.0, true), (24.0, -40.0, false)] {
        for strategy in StrategyKind::ALL {
            let mut estimator = started_with(&flight, *strategy, |params| params.dwell = 2.0);
            let lever_arm = Vector3::z() * arm_m;
            let flown = fly(&mut estimator, &flight.sent(true, true, true), |sent| {
                Some(match sent {
                    Sent::Health(reading) if reading.time_ns == 3 * SECOND => sent.reporting(GpsHealth::Spoofed),
                    Sent::Fix(fix) => {
                        let antenna = Flight::truth(fix.time_ns).world_from_body * lever_arm;
                        let off = Vector3::z() * if fix.time_ns > 3 * SECOND { off_m } else { 0.0 };
                        let position = flight.moved(&fix.position, antenna + off);
                        Sent::Fix(GnssReading { position, lever_arm, velocity: None, ..*fix })
                    }
                    sent => *sent,
                })
            });
            for Flown { at_ns, sent, result, .. } in flown {
                assert!(!matches!(sent, Sent::Fix(_)) || at_ns > 3 * SECOND || result.is_ok(), "{result:?}");
            }
            let gate = estimator.health().gate;
            assert_eq!(gate.is_open(), is_let_in, "{strategy:?}, arm {arm_m} m, off {off_m} m: {gate:?}");
        }
    }
}

/// Spoofed from 5 s to 6 s, and stable since then.
const STABLE_NS: i64 = 6 * SECOND;

/// A time at which the dwell is over, between two frames of the camera.
const DWELT_NS: i64 = STABLE_NS + 11 * SECOND + STEP;

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
        match sent {
            _ if !(from_ns + 1..=until_ns).contains(&time_ns) => {}
            Sent::Fix(_) => {}
            Sent::Anchor(_) if time_ns > STABLE_NS => {}
            sent if (5 * SECOND..STABLE_NS).contains(&time_ns) => {
                ignore(sent.reporting(GpsHealth::Spoofed).to(estimator));
            }
            sent => ignore(sent.to(estimator)),
        }
    }
}

/// A fix this far east of the present estimate.
fn fix(flight: &Flight, estimator: &mut Estimator, time_ns: i64, off_m: f64) -> Rejection {
    let position = flight.moved(&estimator.predicted(time_ns).unwrap().position, Vector3::x() * off_m);
    let refused = estimator.add_gnss(GnssReading { time_ns, position, velocity: None, ..flight.fixes[0] });
    match refused {
        Err(EstimatorError::Degraded(Reason::Gate(rejection))) => rejection,
        other => panic!("{other:?}"),
    }
}

/// An anchor this far east of the present estimate, once time has advanced to it from another.
fn anchor(
    flight: &Flight,
    estimator: &mut Estimator,
    [from_ns, time_ns]: [i64; 2],
    off_m: f64,
) -> Result<Added, EstimatorError> {
    advance(flight, estimator, from_ns, time_ns);
    let EstimatorOutput { position, world_from_body, .. } = estimator.predicted(time_ns).unwrap();
    let (position, covariance) = (flight.moved(&position, Vector3::x() * off_m), Matrix6::identity());
    estimator.add_pose_anchor(PoseAnchor { time_ns, position, world_from_body, covariance, ..flight.anchors[0] })
}

#[test]
fn the_limits_of_the_dwell_of_the_distances_and_of_the_age_of_a_fix() {
    let flight = Flight::new(22, 5);
    let dwell_ns = 10 * SECOND;
    let (open, awaits) = (GateState::Open, GateState::AwaitsAnchor);
    let dwelling = |after_ns: i64| GateState::Dwelling { since_ns: STABLE_NS + after_ns };
    let at = DWELT_NS - STABLE_NS;
    // Times of the fix since the receiver is stable and of the anchor since the fix, and the offset of the fix, m.
    let rows = [
        ("a fix and an anchor a second too early", dwell_ns - SECOND, Some(0), 0.0, &[3][..], dwelling(0)),
        ("a sample too early", dwell_ns - STEP, Some(0), 0.0, &[3], dwelling(0)),
        ("a sample after the dwell", dwell_ns + STEP, Some(STEP), 0.0, &[4], open),
        ("a second after it", dwell_ns + SECOND, Some(STEP), 0.0, &[4], open),
        ("a fix near the estimate", at, None, 199.99, &[4], awaits),
        ("a fix that is too far from the estimate", at, None, 200.1, &[2], dwelling(at)),
        ("a fix near the anchor", at, Some(STEP), 24.99, &[4], open),
        ("a fix near the anchor, on the other side", at, Some(STEP), -24.99, &[4], open),
        ("a fix too far from the anchor", at, Some(STEP), 25.1, &[4, 5], dwelling(at + STEP)),
        ("a fix too far from it, on the other side", at, Some(STEP), -25.1, &[4, 5], dwelling(at + STEP)),
        ("a fix that is two seconds old", at, Some(2 * SECOND), 0.0, &[4], open),
        ("a fix that is older", at, Some(2 * SECOND + STEP), 0.0, &[4], awaits),
    ];
    for (strategy, (what, after_ns, anchor_after_ns, off_m, rejected, gate)) in each(rows) {
        let time_ns = STABLE_NS + after_ns;
        let mut estimator = flown(&flight, strategy, time_ns);
        fix(&flight, &mut estimator, time_ns, off_m);
        if let Some(after_ns) = anchor_after_ns {
            anchor(&flight, &mut estimator, [time_ns, time_ns + after_ns], 0.0).unwrap();
        }
        assert_eq!(estimator.health().gate, gate, "{strategy:?}, {what}");
        let told: Vec<_> = kinds(estimator.sink(), "rejected").collect();
        assert!(told.iter().map(|event| cause(event)).eq(rejected.iter().copied()), "{strategy:?}, {what}");
        for event in told {
            let EventKind::Rejected { rejection } = event.kind else { unreachable!() };
            if let Rejection::TooFar { distance_m } | Rejection::Disagrees { distance_m } = rejection {
                assert!((distance_m - f64::abs(off_m)).abs() < 0.01, "{strategy:?}, {what}: {distance_m}");
            }
        }
    }
}

/// An outlier that happens to agree with the fix, or is sent by the spoofer: it is not in the estimate, and opens nothing.
#[test]
fn an_anchor_that_is_refused_does_not_let_the_receiver_in() {
    let flight = Flight::new(20, 5);
    for strategy in StrategyKind::ALL {
        let mut estimator = flown(&flight, *strategy, DWELT_NS);
        assert_eq!(fix(&flight, &mut estimator, DWELT_NS, 60.0), Rejection::AwaitsAnchor);
        let at = |i: i64| DWELT_NS + 3 * i * FRAME;
        for i in 1..=3 {
            let refused = anchor(&flight, &mut estimator, [at(i - 1), at(i)], 60.0);
            assert!(is_gated(&refused), "{refused:?}");
            assert_eq!(estimator.health().gate, GateState::AwaitsAnchor, "{strategy:?}");
        }
        let is_open = |event: &Event| matches!(event.kind, EventKind::Gate { to: GateState::Open, .. });
        assert!(!estimator.sink().iter().any(is_open));
        // A right one shows that the fix is wrong.
        anchor(&flight, &mut estimator, [at(3), at(3) + STEP], 0.0).unwrap();
        assert_eq!(estimator.health().gate.name(), "dwelling", "{strategy:?}");
    }
}

/// Fixes were where the estimate had been. Anchors that agree move the estimate elsewhere, and the next one fits it: that says nothing of
/// the fixes.
#[test]
fn anchors_that_overrule_the_estimate_do_not_let_a_fix_from_before_in() {
    let flight = Flight::new(42, 5);
    for strategy in StrategyKind::ALL {
        let mut now_ns = DWELT_NS;
        let mut estimator = flown(&flight, *strategy, now_ns);
        let mut moved_ns = None;
        while moved_ns.is_none_or(|moved_ns| now_ns < moved_ns + 10 * FRAME) && now_ns < 41 * SECOND {
            if moved_ns.is_none() {
                assert_eq!(fix(&flight, &mut estimator, now_ns, 0.0), Rejection::AwaitsAnchor);
            }
            advance(&flight, &mut estimator, now_ns, now_ns + 2 * FRAME);
            now_ns += 2 * FRAME;
            let truth = Flight::truth(now_ns);
            let added = estimator.add_pose_anchor(PoseAnchor {
                time_ns: now_ns,
                position: flight.frame.geodetic(&(truth.position + Vector3::x() * 1000.0)),
                world_from_body: truth.world_from_body,
                covariance: Matrix6::identity(),
                ..flight.anchors[0]
            });
            if added.is_err_and(|error| matches!(error.reason(), Reason::Overruled { .. })) {
                moved_ns = Some(now_ns);
            }
        }
        assert!(moved_ns.is_some(), "{strategy:?}");
        assert!(!estimator.health().gate.is_open(), "{strategy:?}: {:?}", estimator.health().gate);
    }
}
