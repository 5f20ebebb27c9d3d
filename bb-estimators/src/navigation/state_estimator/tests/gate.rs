//! The requirements of the spoof gate.

use super::flight::SECOND;
use super::*;
use crate::navigation::Refusal;
use crate::navigation::geodesy::Geodetic;
use nalgebra::Vector3;

/// The receiver and the anchors in a test.
struct Scenario {
    health: fn(i64) -> GpsHealth,
    /// Offset of the fixes, m.
    off: fn(i64) -> f64,
    /// `true` at the times with anchors.
    anchors: fn(i64) -> bool,
}

/// Plays the scenario with a camera. Times are in ns.
fn play(strategy: StrategyKind, scenario: &Scenario) -> (Estimator, Vec<EstimatorOutput>) {
    let flight = Flight::new(40, 5);
    let mut estimator = started(&flight, strategy);
    let mut outputs = Vec::new();
    for sent in &flight.sent(true, true, true) {
        let time_ns = sent.time_ns();
        let result = match sent {
            Sent::Health(reading) => estimator
                .add_gps_health(GpsHealthReading { health: (scenario.health)(time_ns), ..*reading })
                .map(drop),
            Sent::Fix(fix) => {
                let moved = flight.frame.position(&fix.position) + Vector3::x() * (scenario.off)(time_ns);
                estimator.add_gnss(GnssReading { position: flight.frame.geodetic(&moved), ..*fix }).map(drop)
            }
            Sent::Anchor(_) if !(scenario.anchors)(time_ns) => Ok(()),
            sent => sent.to(&mut estimator),
        };
        assert!(result.is_ok() || matches!(sent, Sent::Fix(_)), "{sent:?}: {result:?}");
        outputs.extend(estimator.tick(time_ns));
    }
    for output in &outputs {
        assert!(
            flight.error(output).0 < 5.0,
            "spoofing moves nothing: {} m at {}",
            flight.error(output).0,
            output.time_ns
        );
    }
    (estimator, outputs)
}

/// Changes of the gate: the time in tenths of a second, and the new state.
fn changes(estimator: &Estimator) -> Vec<(i64, &'static str)> {
    let change = |event: &Event| match event.kind {
        EventKind::Gate { to, .. } => (event.time_ns / (SECOND / 10), to.name()),
        _ => unreachable!(),
    };
    kinds(estimator.sink(), "gate").map(change).collect()
}

fn spoofed_from_5_to_10(time_ns: i64) -> GpsHealth {
    if (5 * SECOND..10 * SECOND).contains(&time_ns) { GpsHealth::Spoofed } else { GpsHealth::Stable }
}

#[test]
fn a_spoofed_receiver_is_let_in_after_ten_seconds_and_an_anchor_that_agrees() {
    let off = |time_ns| if (5 * SECOND..10 * SECOND).contains(&time_ns) { 150.0 } else { 0.0 };
    let scenario = Scenario { health: spoofed_from_5_to_10, off, anchors: |_| true };
    for strategy in StrategyKind::ALL {
        let (estimator, _) = play(*strategy, &scenario);
        // The anchor at 20 s comes 15 ms after the full second.
        let expected = [(50, "blocked"), (100, "dwelling"), (200, "awaits_anchor"), (200, "open")];
        assert_eq!(changes(&estimator), expected);
        let rejected = kinds(estimator.sink(), "rejected").count();
        assert_eq!(rejected, 76, "every fix from 5 s to 20 s, both included");
        assert!(kinds(estimator.sink(), "rejected").all(|event| event.level() == Level::Warn));
        assert!(estimator.health().gate.is_open());
    }
}

#[test]
fn without_an_anchor_it_stays_out() {
    let scenario = Scenario {
        health: spoofed_from_5_to_10,
        off: |_| 0.0,
        anchors: |time_ns| !(15 * SECOND..=30 * SECOND).contains(&time_ns),
    };
    for strategy in StrategyKind::ALL {
        let (estimator, _) = play(*strategy, &scenario);
        let expected = [(50, "blocked"), (100, "dwelling"), (200, "awaits_anchor"), (300, "open")];
        assert_eq!(changes(&estimator), expected);
    }
}

#[test]
fn a_break_of_the_health_begins_the_dwell_again() {
    let health = |time_ns| match time_ns / SECOND {
        5..10 => GpsHealth::Spoofed,
        15 => GpsHealth::Unstable,
        _ => GpsHealth::Stable,
    };
    let scenario = Scenario { health, off: |_| 0.0, anchors: |_| true };
    for strategy in StrategyKind::ALL {
        let (estimator, _) = play(*strategy, &scenario);
        let expected = [
            (50, "blocked"),
            (100, "dwelling"),
            (150, "blocked"),
            (160, "dwelling"),
            (260, "awaits_anchor"),
            (260, "open"),
        ];
        assert_eq!(changes(&estimator), expected);
    }
}

#[test]
fn an_anchor_that_disagrees_begins_the_dwell_again() {
    // Reported stable, but 60 m off until 25 s.
    let off = |time_ns| if (5 * SECOND..25 * SECOND).contains(&time_ns) { 60.0 } else { 0.0 };
    let scenario = Scenario { health: spoofed_from_5_to_10, off, anchors: |_| true };
    for strategy in StrategyKind::ALL {
        let (estimator, _) = play(*strategy, &scenario);
        let disagrees: Vec<_> = kinds(estimator.sink(), "rejected")
            .filter(|event| matches!(event.kind, EventKind::Rejected { rejection: Rejection::Disagrees { .. } }))
            .collect();
        assert_eq!(disagrees.len(), 1, "{disagrees:?}");
        let text = disagrees[0].status_text().unwrap();
        assert!(text.as_str().starts_with("NAV GPS rejected: anchor "), "{text}");
        let changes = changes(&estimator);
        assert_eq!(changes[3..], [(200, "dwelling"), (300, "open")][..], "{changes:?}");
    }
}

#[test]
fn a_fix_beyond_the_bounded_distance_begins_the_dwell_again() {
    // 250 m off until 18 s: each of these fixes is rejected.
    let off = |time_ns| if (5 * SECOND..18 * SECOND).contains(&time_ns) { 250.0 } else { 0.0 };
    let scenario = Scenario { health: spoofed_from_5_to_10, off, anchors: |_| true };
    for strategy in StrategyKind::ALL {
        let (estimator, _) = play(*strategy, &scenario);
        let far =
            |event: &&Event| matches!(event.kind, EventKind::Rejected { rejection: Rejection::TooFar { .. } });
        assert_eq!(kinds(estimator.sink(), "rejected").filter(far).count(), 40);
        let opened = changes(&estimator).last().copied().unwrap();
        assert!(opened.1 == "open" && (278..=290).contains(&opened.0), "{opened:?}");
    }
}

/// Each reason is produced, and reaches the recorder at the level warn.
#[test]
fn every_rejection_is_provoked_and_told() {
    // Unhealthy, then spoofed, then far off, then in disagreement with the anchor, then correct.
    let health = |time_ns| match time_ns / SECOND {
        0..2 => GpsHealth::NoFix,
        5..6 => GpsHealth::Spoofed,
        _ => GpsHealth::Stable,
    };
    let off = |time_ns| match time_ns / SECOND {
        6..8 => 250.0,
        8..22 => 60.0,
        _ => 0.0,
    };
    // A receiver that was stable for long enough waits for the next anchor.
    let scenario = Scenario { health, off, anchors: |time_ns| (time_ns / SECOND) % 5 == 4 };
    for strategy in StrategyKind::ALL {
        let (estimator, _) = play(*strategy, &scenario);
        let told = |is_it: fn(&Rejection) -> bool| {
            let rejected = kinds(estimator.sink(), "rejected").filter(|event| {
                matches!(&event.kind, EventKind::Rejected { rejection } if is_it(rejection))
                    && event.level() == Level::Warn
                    && event.status_text().is_some()
            });
            rejected.count()
        };
        let counts = [
            told(|rejection| matches!(rejection, Rejection::Unhealthy)),
            told(|rejection| matches!(rejection, Rejection::Spoofed)),
            told(|rejection| matches!(rejection, Rejection::TooFar { .. })),
            told(|rejection| matches!(rejection, Rejection::Dwelling { .. })),
            told(|rejection| matches!(rejection, Rejection::AwaitsAnchor)),
            told(|rejection| matches!(rejection, Rejection::Disagrees { .. })),
        ];
        assert!(counts.iter().all(|count| *count > 0), "{}: {counts:?}", strategy.name());
        assert_eq!((counts[2], counts[5]), (10, 1), "{}: {counts:?}", strategy.name());
        assert!(estimator.health().gate.is_open());
    }
}

#[test]
fn a_receiver_of_which_nothing_is_reported_is_not_used() {
    let flight = Flight::new(2, 5);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        flight.samples[1..].iter().for_each(|sample| estimator.add_imu(sample).unwrap());
        let refused = estimator.add_gnss(flight.fixes[0]);
        assert_eq!(refused, Err(EstimatorError::Degraded(Reason::Gate(Rejection::Unhealthy))));
    }
}

/// Tests with moved fixes or a moved estimate. Returns the outputs from 4 s on, each with its error from the fixes, and whether it
/// is degraded.
fn moved_fixes(strategy: StrategyKind, with_vio: bool) -> Vec<(f64, f64, bool)> {
    let flight = Flight::new(20, 3);
    let mut estimator = started(&flight, strategy);
    let off = Vector3::new(0.0, 300.0, 0.0);
    let mut outputs = Vec::new();
    for sent in &flight.sent(with_vio, false, true) {
        ignore(match sent {
            Sent::Fix(fix) if fix.time_ns > 4 * SECOND => {
                let position = flight.frame.geodetic(&(flight.frame.position(&fix.position) + off));
                estimator.add_gnss(GnssReading { position, ..*fix }).map(drop)
            }
            sent => sent.to(&mut estimator),
        });
        if let Some(output) = estimator.tick(sent.time_ns()).filter(|_| sent.time_ns() > 4 * SECOND) {
            let apart = flight.frame.position(&output.position) - Flight::truth(output.time_ns).position - off;
            outputs.push((output.time_ns as f64 * 1e-9, apart.norm(), output.degraded));
        }
    }
    outputs
}

/// A receiver that is alone with the IMU overrules the estimate: a gate that is never overridden would lose the position permanently.
#[test]
fn a_receiver_that_is_alone_overrules_the_estimate() {
    for strategy in StrategyKind::ALL {
        let outputs = moved_fixes(*strategy, false);
        for (time_s, error_m, degraded) in &outputs {
            let is_told = *degraded || *time_s < 4.5;
            assert!(*error_m < 20.0 || is_told, "{}: {error_m} m at {time_s} s", strategy.name());
        }
        let (_, error_m, degraded) = outputs[outputs.len() - 1];
        assert!(error_m < 10.0 && !degraded, "{}: {error_m} m", strategy.name());
    }
}

/// Random fixes contradict one another: none is believed after any number of refusals, and none affects the estimate.
#[test]
fn fixes_and_anchors_that_do_not_agree_overrule_nothing() {
    let flight = Flight::new(80, 3);
    let wild = |position: &Geodetic, i: usize| {
        let (sin, cos) = (i as f64 * 2.4).sin_cos();
        let off = Vector3::new(cos, sin, 0.1) * 3000.0 * (1.0 + (i % 3) as f64);
        flight.frame.geodetic(&(flight.frame.position(position) + off))
    };
    for strategy in StrategyKind::ALL {
        for with_anchors in [false, true] {
            let mut estimator = started(&flight, *strategy);
            for (i, sent) in flight.sent(with_anchors, with_anchors, !with_anchors).iter().enumerate() {
                let is_wild = (65 * SECOND..75 * SECOND).contains(&sent.time_ns());
                ignore(match sent {
                    Sent::Fix(fix) if is_wild => {
                        let position = wild(&fix.position, i);
                        estimator.add_gnss(GnssReading { position, ..*fix }).map(drop)
                    }
                    Sent::Anchor(anchor) if is_wild => {
                        let position = wild(&anchor.position, i);
                        estimator.add_pose_anchor(PoseAnchor { position, ..*anchor }).map(drop)
                    }
                    sent => sent.to(&mut estimator),
                });
                if let Some(output) = estimator.tick(sent.time_ns()) {
                    let (error_m, _) = flight.error(&output);
                    assert!(error_m < 10.0, "{}: {error_m} m at {}", strategy.name(), output.time_ns);
                }
            }
            assert_eq!(count(estimator.sink(), "started"), 1);
            let refused = |event: &Event| {
                matches!(event.kind, EventKind::Degraded { reason: Reason::Refused(Refusal::Gate { .. }), .. })
            };
            // Exactly the random ones are refused.
            let expected = if with_anchors { 10 } else { 50 };
            assert_eq!(estimator.sink().iter().filter(|event| refused(event)).count(), expected);
            assert_eq!(count(estimator.sink(), "degraded"), expected, "{}", strategy.name());
        }
    }
}

/// The estimate is kilometres off, through a stopped clock or a wrong world, and the fixes agree. The attitude is kept.
#[test]
fn a_receiver_that_is_alone_moves_an_estimate_that_is_kilometres_off() {
    let flight = Flight::new(95, 3);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        let off = Vector3::new(-7000.0, 9000.0, 30.0);
        let (mut moved_ns, mut worst, mut turned) = (None, 0.0_f64, 0.0_f64);
        for sent in &flight.sent(false, false, true) {
            let is_off = sent.time_ns() > 65 * SECOND;
            ignore(match sent {
                Sent::Fix(fix) if is_off => {
                    let position = flight.frame.geodetic(&(flight.frame.position(&fix.position) + off));
                    estimator.add_gnss(GnssReading { position, ..*fix }).map(drop)
                }
                sent => sent.to(&mut estimator),
            });
            // With it, the keyframes of the window leave.
            let newest = estimator.sink().iter().rev().take(40);
            let mut raised = newest.filter_map(|event| match event.kind {
                EventKind::Degraded { reason: Reason::Overruled { nis: factor }, .. } => {
                    Some((event.time_ns, factor))
                }
                _ => None,
            });
            if let (Some((time_ns, factor)), None) = (raised.next_back(), moved_ns) {
                assert!(factor > 1000.0, "{factor}");
                moved_ns = Some(time_ns);
            }
            if let (Some(_), Some(output)) = (moved_ns, estimator.tick(sent.time_ns())) {
                let apart = flight.frame.position(&output.position) - Flight::truth(output.time_ns).position - off;
                worst = worst.max(apart.norm());
                turned = turned.max(flight.error(&output).1);
            }
        }
        // The first to come 20 s after another that agrees.
        assert_eq!(moved_ns.map(|time_ns| (time_ns - 65 * SECOND) / (SECOND / 5)), Some(100));
        assert!(worst < 10.0 && turned < 0.05, "{}: {worst} m, {turned} rad", strategy.name());
        let started: Vec<_> = kinds(estimator.sink(), "started").map(|event| event.kind).collect();
        assert_eq!(started[1..], [EventKind::Started { from: StartedFrom::Receiver }], "once");
        assert_eq!(estimator.predicted(95 * SECOND).map(|output| output.resets), Some(1));
        assert_eq!(estimator.health().state, HealthState::Tracking, "five fixes have confirmed it");
    }
}

/// A receiver beside a camera never overrules the estimate, but it is reported as degraded.
#[test]
fn a_receiver_beside_a_camera_never_overrules_it() {
    for strategy in StrategyKind::ALL {
        let outputs = moved_fixes(*strategy, true);
        let late = outputs.iter().filter(|(time_s, ..)| *time_s > 4.7);
        for (time_s, error_m, degraded) in late {
            assert!(
                (280.0..320.0).contains(error_m) && *degraded,
                "{}: {error_m} m at {time_s} s",
                strategy.name()
            );
        }
    }
}

/// After a long time without a camera, an anchor moves the estimate far. A fix is compared with the anchor, not with what the anchor
/// has corrected: one that follows the wrong estimate stays out, and one that agrees with the anchor is let in.
#[test]
fn what_an_anchor_corrects_is_no_difference_to_a_fix() {
    let flight = Flight::new(120, 5);
    for strategy in StrategyKind::ALL {
        for is_genuine in [true, false] {
            let mut estimator = started(&flight, *strategy);
            let mut judged = None;
            for sent in &flight.sent(true, true, true) {
                let time_ns = sent.time_ns();
                let is_blind = time_ns > 10 * SECOND;
                let off = |estimator: &mut Estimator| {
                    estimator.predicted(time_ns).map(|output| (flight.error(&output).0, output))
                };
                match sent {
                    Sent::Health(reading) => {
                        let health = spoofed_from_5_to_10(time_ns);
                        estimator.add_gps_health(GpsHealthReading { health, ..*reading }).unwrap();
                    }
                    Sent::Fix(_) if time_ns < 22 * SECOND => {}
                    Sent::Fix(fix) => {
                        let (_, estimate) = off(&mut estimator).unwrap();
                        let position = if is_genuine { fix.position } else { estimate.position };
                        let added = estimator.add_gnss(GnssReading { position, ..*fix });
                        assert!(matches!(added, Ok(Added::Waits)), "it is judged with the next sample: {added:?}");
                    }
                    Sent::Vio(_) if is_blind => {}
                    Sent::Anchor(anchor) if is_blind => {
                        let (error_m, _) = off(&mut estimator).unwrap();
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
            let error_m = judged.unwrap();
            let gate = estimator.health().gate;
            assert_eq!(gate.is_open(), is_genuine, "{}, off by {error_m} m: {gate:?}", strategy.name());
        }
    }
}

/// Anchors are positions of the body, and fixes are of the antenna: how they are mounted is no difference between them.
#[test]
fn a_receiver_is_let_in_by_where_its_antenna_puts_the_body() {
    let flight = Flight::new(9, 4);
    // With an arm of 24 m, a fix 40 m too low is 16 m from the body.
    for (arm_m, off_m, is_let_in) in [(60.0, 0.0, true), (24.0, -40.0, false)] {
        for strategy in StrategyKind::ALL {
            let mut config = config(*strategy);
            config.params.dwell = 2.0;
            let mut estimator: Estimator = FlightNavigator::new(config, Events::new()).unwrap();
            estimator.warm_start(flight.warm_start(0)).unwrap();
            estimator.add_imu(&flight.samples[0]).unwrap();
            let lever_arm = Vector3::new(0.0, 0.0, arm_m);
            for sent in &flight.sent(true, true, true) {
                let is_after = sent.time_ns() > 3 * SECOND;
                ignore(match sent {
                    Sent::Health(reading) if reading.time_ns == 3 * SECOND => estimator
                        .add_gps_health(GpsHealthReading { health: GpsHealth::Spoofed, ..*reading })
                        .map(drop),
                    Sent::Fix(fix) => {
                        let antenna = Flight::truth(fix.time_ns).world_from_body * lever_arm;
                        let off = Vector3::new(0.0, 0.0, if is_after { off_m } else { 0.0 });
                        let position =
                            flight.frame.geodetic(&(flight.frame.position(&fix.position) + antenna + off));
                        let fix = GnssReading { position, lever_arm, velocity: None, ..*fix };
                        let added = estimator.add_gnss(fix).map(drop);
                        assert!(is_after || added.is_ok(), "{added:?}");
                        added
                    }
                    sent => sent.to(&mut estimator),
                });
            }
            let gate = estimator.health().gate;
            assert_eq!(gate.is_open(), is_let_in, "{}, arm {arm_m} m, off {off_m} m: {gate:?}", strategy.name());
        }
    }
}
