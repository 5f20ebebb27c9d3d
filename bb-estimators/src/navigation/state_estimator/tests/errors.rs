//! Each kind of error, and the fallback.

use super::flight::{SECOND, STEP};
use super::*;
use crate::navigation::Refusal;
use nalgebra::Vector3;

#[test]
fn degraded_an_outlier_is_refused_and_the_estimate_goes_on() {
    let flight = Flight::new(8, 2);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        let mut outputs = 0;
        for sent in &flight.sent(true, true, false) {
            match sent {
                Sent::Anchor(anchor) if anchor.time_ns > 5 * SECOND => {
                    let moved = flight.frame.position(&anchor.position) + Vector3::new(80.0, 0.0, 0.0);
                    let outlier = PoseAnchor { position: flight.frame.geodetic(&moved), ..*anchor };
                    let error = estimator.add_pose_anchor(outlier).unwrap_err();
                    let EstimatorError::Degraded(Reason::Refused(Refusal::Gate { nis, limit })) = error else {
                        panic!("{error:?}")
                    };
                    // 80 m at 1.5 m of the anchor and up to 2 m of the estimate: more than ten deviations.
                    assert!(nis > 1000.0 && limit == 100.0, "{nis}, {limit}");
                }
                sent => sent.to(&mut estimator).unwrap(),
            }
            if let Some(output) = estimator.tick(sent.time_ns()) {
                outputs += 1;
                assert!(flight.error(&output).0 < 5.0);
            }
        }
        assert_eq!(outputs, 40);
        // Three consecutive refusals are more than an outlier.
        assert_eq!(estimator.health().state, HealthState::Degraded);
        let degraded = estimator.predicted(8 * SECOND).unwrap();
        assert!(degraded.degraded && degraded.label == SourceLabel::VisualPropagated, "it keeps its label");
    }
}

#[test]
fn degraded_positions_that_agree_on_another_place_move_the_estimate() {
    let flight = Flight::new(12, 2);
    let off = Vector3::new(80.0, 0.0, 0.0);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        let mut overruled = Vec::new();
        for sent in &flight.sent(true, true, false) {
            let Sent::Anchor(anchor) = sent else {
                // The first frame after a jump begins anew.
                ignore(sent.to(&mut estimator));
                continue;
            };
            let is_off = anchor.time_ns > 4 * SECOND;
            let moved = flight.frame.position(&anchor.position) + if is_off { off } else { Vector3::zeros() };
            let position = flight.frame.geodetic(&moved);
            let result = estimator.add_pose_anchor(PoseAnchor { position, ..*anchor });
            let Err(error) = result else { continue };
            assert!(is_off && !error.is_fatal(), "{error}");
            if let Reason::Overruled { nis } = error.reason() {
                assert!(nis > 100.0, "{nis}");
                overruled.push(anchor.time_ns / SECOND);
            }
        }
        // It had been right for 4 s, and then they had agreed for as long; the smoother judges a frame later.
        assert!(matches!(overruled[..], [8 | 9]), "{}: {overruled:?}", strategy.name());
        let there = estimator.predicted(12 * SECOND).unwrap();
        let error = flight.frame.position(&there.position) - Flight::truth(12 * SECOND).position - off;
        assert!(error.norm() < 5.0 && there.resets == 1, "{}: {error}", strategy.name());
    }
}

/// The smoother tells that its iterations have not converged, and follows the filter, which has none.
#[test]
fn degraded_a_correction_that_does_not_converge_is_told() {
    let flight = Flight::new(3, 2);
    let mut places = Vec::new();
    for strategy in StrategyKind::ALL {
        let mut estimator: Providing = FlightNavigator::new(config(*strategy), Events::new()).unwrap();
        estimator.warm_start(flight.warm_start(0)).unwrap();
        flight.samples.iter().for_each(|sample| estimator.add_imu(sample).unwrap());
        let time_ns = 3 * SECOND - STEP;
        let result = estimator.add_factor(time_ns, 0, Provided::Ahead);
        let output = estimator.predicted(3 * SECOND).unwrap();
        if strategy.is_smoothing() {
            assert_eq!(result, Err(EstimatorError::Degraded(Reason::NotConverged)));
            let input = InputKind::Factor;
            let told = EventKind::Degraded { input, reason: Reason::NotConverged };
            assert_eq!(kinds(estimator.sink(), "degraded").map(|event| event.kind).collect::<Vec<_>>(), [told]);
        } else {
            assert!(matches!(result, Ok(Added::Taken { .. })), "{result:?}");
        }
        assert_eq!(output.degraded, strategy.is_smoothing(), "it is emitted, but degraded");
        places.push(flight.frame.position(&output.position));
    }
    assert!(places.iter().all(|place| (place - places[0]).norm() < 1e-3), "{places:?}");
}

/// The smoother linearises a factor again where the estimate has moved to.
#[test]
fn degraded_a_provider_that_ignores_what_is_refused_does_not_break_the_estimate() {
    let flight = Flight::new(3, 2);
    for strategy in StrategyKind::ALL {
        let mut estimator: Providing = FlightNavigator::new(config(*strategy), Events::new()).unwrap();
        estimator.warm_start(flight.warm_start(0)).unwrap();
        flight.samples.iter().for_each(|sample| estimator.add_imu(sample).unwrap());
        let time_ns = 3 * SECOND - STEP;
        let position = estimator.predicted(time_ns).unwrap().position;
        let x = estimator.frame().unwrap().position(&position).x;
        let added = estimator.add_factor(time_ns, 0, Provided::Careless(x));
        assert!(!added.is_err_and(|error| error.is_fatal()), "{}: {added:?}", strategy.name());
        let (position, _) = flight.error(&estimator.predicted(3 * SECOND).unwrap());
        assert!(position < 12.0, "{}: {position} m", strategy.name());
        assert_eq!(count(estimator.sink(), "fatal"), 0);
    }
}

#[test]
fn fatal_a_window_that_overflows_has_no_estimate_for_this_tick() {
    let flight = Flight::new(3, 2);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        flight.samples[1..].iter().for_each(|sample| estimator.add_imu(sample).unwrap());
        assert!(estimator.tick(3 * SECOND).is_some());
        let mut overflows = 0;
        let later = Flight::new(6, 2);
        for provider in 0..600 {
            // All of them wait for the IMU: a flood.
            let anchor = PoseAnchor { provider, time_ns: 3 * SECOND + i64::from(provider), ..later.anchors[2] };
            overflows +=
                usize::from(estimator.add_pose_anchor(anchor) == Err(EstimatorError::Fatal(Reason::Overflow)));
        }
        assert!(overflows >= 88, "{overflows}");
        assert_eq!(estimator.counts().overflows, overflows as u64);
        assert!(estimator.tick(3 * SECOND + SECOND / 5).is_none(), "none for this tick");
        later.samples[600..].iter().for_each(|sample| estimator.add_imu(sample).unwrap());
        assert!(estimator.tick(6 * SECOND).is_some(), "then there is");
        assert!(estimator.add_pose_anchor(later.anchors[4]).is_ok(), "and there is room again");
    }
}

/// A flood of what the flight controller sends only degrades: it takes no room from the camera and the anchors.
#[test]
fn degraded_a_flood_of_the_flight_controller_stops_no_estimate() {
    let flight = Flight::new(8, 2);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        let (mut outputs, mut overflows) = (0, 0);
        for sent in &flight.sent(true, true, false) {
            sent.to(&mut estimator).unwrap();
            let time_ns = sent.time_ns();
            // Every 5 ms, five of each: 3,000 a second, instead of 128 altogether.
            for i in 0..5 {
                let time_ns = time_ns + i;
                let window = FlightControllerWindow {
                    imu: &[],
                    attitudes: &[AttitudeReading { time_ns, ..flight.warm_start(0).attitude }],
                    health: &[GpsHealthReading { time_ns, health: GpsHealth::Unstable }],
                    fixes: &[GnssReading {
                        time_ns,
                        ..flight.fixes[(time_ns / (SECOND / 5)).clamp(1, 39) as usize - 1]
                    }],
                };
                match estimator.add_fc_imu(&window) {
                    Err(EstimatorError::Degraded(Reason::Overflow)) => overflows += 1,
                    Err(error) => assert!(!error.is_fatal(), "{error}"),
                    Ok(()) => {}
                }
            }
            outputs += u32::from(estimator.tick(time_ns).is_some());
        }
        assert_eq!((outputs, count(estimator.sink(), "fatal")), (40, 0), "{}", strategy.name());
        assert!(overflows > 1000 && estimator.counts().overflows > overflows, "{overflows}");
        let told = |event: &&Event| matches!(event.kind, EventKind::Degraded { reason: Reason::Overflow, .. });
        let told = kinds(estimator.sink(), "degraded").filter(told).count();
        assert_eq!(told as u64, estimator.counts().overflows, "each is told");
    }
}

#[test]
fn degraded_numbers_that_are_no_good_are_refused_however_often() {
    let flight = Flight::new(3, 2);
    for strategy in StrategyKind::ALL {
        let mut estimator: Providing = FlightNavigator::new(config(*strategy), Events::new()).unwrap();
        estimator.warm_start(flight.warm_start(0)).unwrap();
        flight.samples.iter().for_each(|sample| estimator.add_imu(sample).unwrap());
        let before = estimator.predicted(3 * SECOND);
        for i in 0..9 {
            let result = estimator.add_factor(2 * SECOND + i * STEP, 0, Provided::Along(1e12));
            let gated = |error: &EstimatorError| matches!(error.reason(), Reason::Refused(Refusal::Gate { .. }));
            assert!(result.as_ref().is_err_and(|error| !error.is_fatal() && gated(error)), "{result:?}");
        }
        let after = estimator.predicted(3 * SECOND);
        assert_eq!(after.map(|output| output.position), before.map(|output| output.position));
    }
}

#[test]
fn fatal_after_a_minute_without_the_imu_it_is_lost_until_an_anchor() {
    let flight = Flight::new(3, 2);
    let later = Flight::new(83, 2);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        flight.samples[1..].iter().for_each(|sample| estimator.add_imu(sample).unwrap());
        let between = |from: i64, to: i64| {
            later.samples.iter().filter(move |sample| (from * SECOND + 1..=to * SECOND).contains(&sample.time_ns))
        };
        let results: Vec<_> = between(70, 80).map(|sample| estimator.add_imu(sample)).collect();
        // A few samples might have corrupt stamps.
        for (i, result) in results[..100].iter().enumerate() {
            let ahead = Refusal::InTheFuture { time_ns: 70 * SECOND + (i as i64 + 1) * STEP };
            assert_eq!(*result, Err(EstimatorError::Degraded(Reason::Refused(ahead))));
        }
        assert_eq!(results[100], Err(EstimatorError::Degraded(Reason::Bridged)));
        assert!(results[101..].iter().all(Result::is_ok));
        assert_eq!(estimator.health().state, HealthState::Lost);
        assert_eq!(count(estimator.sink(), "fatal"), 1);
        assert!(estimator.current_estimate().is_none() && estimator.predicted(80 * SECOND).is_none());
        estimator.add_pose_anchor(later.anchors[78]).unwrap();
        assert!(later.error(&estimator.current_estimate().unwrap()).0 < 5.0);
        assert_eq!(estimator.health().state, HealthState::Degraded, "one alone may be an outlier");
        between(80, 81).for_each(|sample| estimator.add_imu(sample).unwrap());
        estimator.add_pose_anchor(later.anchors[79]).unwrap();
        between(81, 83).for_each(|sample| estimator.add_imu(sample).unwrap());
        assert_eq!(estimator.health().state, HealthState::Tracking);
    }
}

#[test]
fn without_an_estimate_for_three_seconds_the_fallback_engages_once_and_recovers_once() {
    let flight = Flight::new(20, 2);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        for i in 2..=20 * 200 {
            let time_ns = i * STEP;
            // The IMU is silent from 5 s to 12 s.
            if !(5 * SECOND..12 * SECOND).contains(&time_ns) {
                let _ = estimator.add_imu(&flight.samples[i as usize - 1]);
            }
            estimator.tick(time_ns);
            let is_silent = (9 * SECOND..12 * SECOND).contains(&time_ns);
            assert_eq!(estimator.health().is_fallback_engaged && is_silent, is_silent);
        }
        let times =
            |name| kinds(estimator.sink(), name).map(|event| event.time_ns / (SECOND / 10)).collect::<Vec<_>>();
        // The last estimate was at 5.0 s, or at 5.2 s by prediction.
        let engaged = times("fallback_engaged");
        assert!(engaged.len() == 1 && (80..=84).contains(&engaged[0]), "{engaged:?}");
        // A gap of this length is believed only after half a second of samples.
        assert_eq!(times("fallback_recovered"), [126]);
        assert_eq!(times("fallback_imminent").len(), 1);
        let levels: Vec<_> = ["fallback_imminent", "fallback_engaged", "fallback_recovered"]
            .iter()
            .flat_map(|name| kinds(estimator.sink(), name).map(Event::level))
            .collect();
        assert_eq!(levels, [Level::Error, Level::Error, Level::Info]);
    }
}

#[test]
fn a_clock_that_is_set_back_has_no_estimate_and_engages_the_fallback() {
    let flight = Flight::new(8, 2);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        for sent in &flight.sent(true, true, false) {
            sent.to(&mut estimator).unwrap();
            estimator.tick(sent.time_ns());
        }
        let set_back = 8 * SECOND - 100 * SECOND;
        assert!(estimator.predicted(set_back).is_none());
        let outputs = (0..50).filter(|i| estimator.tick(set_back + i * SECOND / 10).is_some()).count();
        assert_eq!((outputs, estimator.health().state), (0, HealthState::Lost));
    }
}
