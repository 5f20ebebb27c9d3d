//! Each kind of error, and each reason for which an input is not in the estimate: provoked, counted and reported.

use super::strategy::{Measured, Strategy};
use super::*;
use crate::navigation::AbsolutePose;
use crate::navigation::eskf::Start;

#[test]
fn degraded_an_outlier_is_refused_and_the_estimate_goes_on() {
    for (_, flight, mut estimator) in flights(8, 2) {
        let flown = fly(&mut estimator, &flight.sent(true, true, false), |sent| {
            if sent.time_ns() > 5 * SECOND { flight.moving(sent, Vector3::x() * 80.0) } else { *sent }
        });
        for Flown { at_ns, sent, result, .. } in &flown {
            if !matches!(sent, Sent::Anchor(_)) || *at_ns < 5 * SECOND {
                assert_eq!(*result, Ok(()));
                continue;
            }
            let Err(EstimatorError::Degraded(Reason::Refused(Refusal::Gate { nis, limit }))) = result else {
                panic!("{result:?}")
            };
            // 80 m at 1.5 m of the anchor and up to 2 m of the estimate: more than ten deviations.
            assert!(*nis > 1000.0 && *limit == 100.0, "{nis}, {limit}");
        }
        let outputs: Vec<_> = flown.iter().filter_map(|flown| flown.output).collect();
        assert!(outputs.len() == 40 && outputs.iter().all(|output| flight.error(output).0 < 5.0));
        // Three consecutive refusals are more than an outlier.
        assert_eq!(estimator.health().state, HealthState::Degraded);
        let degraded = estimator.predicted(8 * SECOND).unwrap();
        assert!(degraded.degraded && degraded.label == SourceLabel::VisualPropagated, "it keeps its label");
    }
}

#[test]
fn degraded_positions_that_agree_on_another_place_move_the_estimate() {
    let off = Vector3::new(80.0, 0.0, 0.0);
    for (strategy, flight, mut estimator) in flights(12, 2) {
        let flown = fly(&mut estimator, &flight.sent(true, true, false), |sent| match sent {
            Sent::Anchor(anchor) if anchor.time_ns > 4 * SECOND => flight.moving(sent, off),
            _ => *sent,
        });
        // The first frame after a jump may be refused; only anchors count.
        let overruled = flown.iter().filter(|flown| matches!(flown.sent, Sent::Anchor(_))).filter_map(|flown| {
            let error = flown.result.err()?;
            assert!(flown.sent.time_ns() > 4 * SECOND && !error.is_fatal(), "{strategy:?}: {error}");
            let Reason::Overruled { nis } = error.reason() else { return None };
            assert!(nis > 100.0, "{strategy:?}: {nis}");
            Some(flown.sent.time_ns() / SECOND)
        });
        let overruled: Vec<_> = overruled.collect();
        // It had been right for 4 s, and then they had agreed for as long; the smoother judges a frame later.
        assert!(matches!(overruled[..], [8 | 9]), "{strategy:?}: {overruled:?}");
        let there = estimator.predicted(12 * SECOND).unwrap();
        assert!((flight.off(&there) - off).norm() < 5.0 && there.resets == 1, "{strategy:?}: {there:?}");
    }
}

/// The smoother tells that its iterations have not converged, and follows the filter, which has none.
#[test]
fn degraded_a_correction_that_does_not_converge_is_told() {
    let flight = Flight::new(3, 2);
    let mut places = Vec::new();
    for strategy in StrategyKind::ALL {
        let mut estimator: Providing = by_imu(&flight, *strategy);
        let result = estimator.add_factor(3 * SECOND - STEP, 0, Provided::Ahead);
        let output = estimator.predicted(3 * SECOND).unwrap();
        if strategy.is_smoothing() {
            assert_eq!(result, degraded(Reason::NotConverged));
            let told = EventKind::Degraded { input: InputKind::Factor, reason: Reason::NotConverged };
            assert!(kinds(estimator.sink(), "degraded").map(|event| event.kind).eq([told]));
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
    for (strategy, flight, mut estimator) in flights_by_imu::<Provided>(3, 2) {
        let time_ns = 3 * SECOND - STEP;
        let position = estimator.predicted(time_ns).unwrap().position;
        let x = estimator.frame().unwrap().position(&position).x;
        let added = estimator.add_factor(time_ns, 0, Provided::Careless(x));
        assert!(!added.is_err_and(|error| error.is_fatal()), "{strategy:?}: {added:?}");
        let (error_m, _) = flight.error(&estimator.predicted(3 * SECOND).unwrap());
        assert!(error_m < 12.0, "{strategy:?}: {error_m} m");
        assert_eq!(count(estimator.sink(), "fatal"), 0);
    }
}

#[test]
fn degraded_numbers_that_are_no_good_are_refused_however_often() {
    for (_, _, mut estimator) in flights_by_imu::<Provided>(3, 2) {
        let before = estimator.predicted(3 * SECOND).map(|output| output.position);
        for i in 0..9 {
            let result = estimator.add_factor(2 * SECOND + i * STEP, 0, Provided::Along(1e12));
            assert!(is_gated(&result), "{result:?}");
        }
        assert_eq!(estimator.predicted(3 * SECOND).map(|output| output.position), before);
    }
}

#[test]
fn fatal_after_a_minute_without_the_imu_it_is_lost_until_an_anchor() {
    let flight = Flight::new(3, 2);
    let later = Flight::new(83, 2);
    for strategy in StrategyKind::ALL {
        let mut estimator: Estimator = by_imu(&flight, *strategy);
        let between = |from: usize, to: usize| &later.samples[from * 200..to * 200];
        let results: Vec<_> = between(70, 80).iter().map(|sample| estimator.add_imu(sample)).collect();
        // A few samples might have corrupt stamps.
        for (result, ImuMean { time_ns, .. }) in results[..100].iter().zip(between(70, 80)) {
            assert_eq!(*result, degraded(Refusal::InTheFuture { time_ns: *time_ns }));
        }
        assert_eq!(results[100], degraded(Reason::Bridged));
        assert!(results[101..].iter().all(Result::is_ok));
        assert_eq!(estimator.health().state, HealthState::Lost);
        assert_eq!(count(estimator.sink(), "fatal"), 1);
        assert!(estimator.current_estimate().is_none() && estimator.predicted(80 * SECOND).is_none());
        estimator.add_pose_anchor(later.anchors[78]).unwrap();
        assert!(later.error(&estimator.current_estimate().unwrap()).0 < 5.0);
        assert_eq!(estimator.health().state, HealthState::Degraded, "one alone may be an outlier");
        add_all(&mut estimator, between(80, 81));
        estimator.add_pose_anchor(later.anchors[79]).unwrap();
        add_all(&mut estimator, between(81, 83));
        assert_eq!(estimator.health().state, HealthState::Tracking);
    }
}

/// Two seconds of flight, without anchors.
fn flown(flight: &Flight, strategy: StrategyKind) -> Providing {
    let mut estimator: Providing = FlightNavigator::new(config(strategy), Events::new()).unwrap();
    estimator.warm_start(flight.warm_start(0)).unwrap();
    add_all(&mut estimator, &flight.samples[..400]);
    for vio in &flight.vio[..19] {
        assert!(estimator.add_vio(*vio).is_ok());
    }
    estimator
}

fn refused<T>(result: Result<T, EstimatorError>) -> Refusal {
    match result.map(drop) {
        Err(EstimatorError::Degraded(Reason::Refused(refusal))) => refusal,
        other => panic!("{other:?}"),
    }
}

#[test]
fn every_refusal_that_a_user_can_see() {
    let flight = Flight::new(4, 3);
    let (vio, anchor) = (flight.vio[19], flight.anchors[0]);
    for strategy in StrategyKind::ALL {
        let mut cold: Providing = FlightNavigator::new(config(*strategy), Events::new()).unwrap();
        add_all(&mut cold, &flight.samples[..200]);
        assert_eq!(refused(cold.add_vio(flight.vio[4])), Refusal::NotStarted);

        let mut estimator = flown(&flight, *strategy);
        let zero = Matrix6::zeros();
        let off = flight.moved(&anchor.position, Vector3::x() * 90.0);
        let bias = ImuBias { accelerometer: Vector3::repeat(20.0), gyroscope: Vector3::zeros() };
        let nan = Vector3::repeat(f64::NAN);
        assert_eq!(refused(estimator.add_vio(VioOutput { translation: nan, ..vio })), Refusal::NonFinite);
        assert_eq!(refused(estimator.add_vio(VioOutput { bias: Some(bias), ..vio })), Refusal::OutOfRange);
        assert_eq!(refused(estimator.add_pose_anchor(PoseAnchor { covariance: zero, ..anchor })), Refusal::Noise);
        let (previous_ns, time_ns) = (vio.to_ns, vio.from_ns);
        let back = VioOutput { from_ns: vio.to_ns, to_ns: vio.from_ns, ..vio };
        assert_eq!(refused(estimator.add_vio(back)), Refusal::TimeNotIncreasing { previous_ns, time_ns });
        let far = estimator.add_pose_anchor(PoseAnchor { position: off, ..anchor });
        assert!(is_gated(&far), "{far:?}");
        let unknown = refused(estimator.add_vio(VioOutput { from_ns: 3 * STEP, ..vio }));
        assert!(matches!(unknown, Refusal::NoKeyframe { .. }), "{unknown:?}");
        let blind = refused(estimator.add_factor(2 * SECOND - STEP, 0, Provided::Nothing));
        assert_eq!(blind, Refusal::NotObservable);
        let elsewhere = refused(estimator.add_factor(2 * SECOND - STEP, 1, Provided::Elsewhere));
        assert_eq!(elsewhere, Refusal::OutOfRange, "what a provider refuses is not the end of the estimate");
        for (provider, factor) in [(2, Provided::Unset), (3, Provided::Unnamed)] {
            let useless = refused(estimator.add_factor(2 * SECOND - STEP, provider, factor));
            assert_eq!(useless, Refusal::NotObservable, "{strategy:?}: {factor:?}");
        }
        let old = PoseAnchor { time_ns: -SECOND, ..anchor };
        assert_eq!(refused(estimator.add_pose_anchor(old)), Refusal::TooOld { time_ns: -SECOND });
        let ahead = PoseAnchor { time_ns: 3 * SECOND, ..anchor };
        assert_eq!(refused(estimator.add_pose_anchor(ahead)), Refusal::InTheFuture { time_ns: 3 * SECOND });
        assert_eq!(estimator.add_vio(flight.vio[3]), degraded(Reason::Duplicate));

        let counts = *estimator.counts();
        let counted = [counts.invalid, counts.too_old, counts.in_the_future, counts.duplicates];
        assert_eq!(counted, [4, 1, 1, 1]);
        // The frame 15 ms after the start also separates the two of the first relative pose, which was in the estimate: the filter holds
        // only the last frame, and the window both.
        let first_ns = flight.vio[0].to_ns;
        let told = times_of(estimator.sink(), "degraded");
        let revised = told.iter().filter(|time_ns| **time_ns == first_ns).count();
        let separated = usize::from(!estimator.is_smoothing());
        assert_eq!((told.len(), revised), (13 + separated, separated), "each is told: {:#?}", estimator.counts());
    }
}

/// A keyframe of the smoother takes a limited number. The filter holds none of them, and takes any number.
#[test]
fn factors_beyond_the_room_of_a_keyframe_are_refused() {
    let flight = Flight::new(4, 3);
    for strategy in StrategyKind::ALL {
        let mut estimator = flown(&flight, *strategy);
        let truth = flight.frame.geodetic(&Flight::truth(2 * SECOND).position);
        let place = GnssPosition::new(estimator.frame().unwrap().position(&truth), 2.0, 2.0);
        let add = |provider| estimator.add_factor(2 * SECOND, provider, Provided::Place(place.into())).map(drop);
        let results: Vec<_> = (0..20).map(add).collect();
        let refusals = results.into_iter().filter(Result::is_err).map(refused);
        let full = refusals.inspect(|refusal| assert!(matches!(refusal, Refusal::Full { .. }), "{refusal:?}"));
        let expected = if strategy.is_smoothing() { 4 } else { 0 };
        assert_eq!(full.count(), expected, "{strategy:?}");
        assert!(estimator.predicted(2 * SECOND).is_some());
    }
}

/// Samples within the range of a sensor move the estimate to an impossible position for an aircraft. The flight controller, or an
/// anchor, then provides the right one.
#[test]
fn an_estimate_that_was_led_off_the_earth_is_lost() {
    let flight = Flight::new(40, 3);
    for strategy in StrategyKind::ALL {
        let mut estimator = flown(&flight, *strategy);
        let mut lost_ns = None;
        for sample in &flight.samples[400..6000] {
            let broken = ImuMean { specific_force: Vector3::new(0.0, 0.0, 900.0), ..*sample };
            ignore(estimator.add_imu(&broken));
            if estimator.health().state == HealthState::Lost && lost_ns.is_none() {
                lost_ns = Some(sample.time_ns);
                // The time at which it was lost is run again.
                let (time_ns, health) = (sample.time_ns - FRAME, GpsHealth::Unstable);
                let before = estimator.counts().reruns;
                estimator.add_gps_health(GpsHealthReading { time_ns, health }).unwrap();
                assert_eq!(estimator.counts().reruns, before + 1, "{strategy:?}");
            }
        }
        let lost_ns = lost_ns.unwrap();
        // 10 km/s at 890 m/s².
        assert!((lost_ns - 13 * SECOND).abs() < SECOND, "{strategy:?}: {lost_ns}");
        let fatal: Vec<_> = kinds(estimator.sink(), "fatal").map(|event| event.kind).collect();
        let reason = Reason::Refused(Refusal::OutOfRange);
        assert_eq!(fatal, [EventKind::Fatal { input: InputKind::Imu, reason }], "once");
        let state = flight.warm_start(30 * SECOND);
        assert!(estimator.warm_start(state).is_ok(), "it takes what the flight controller knows");
        add_all(&mut estimator, &flight.samples[6000..]);
        let found = estimator.predicted(40 * SECOND).unwrap();
        assert!(flight.error(&found).0 < 30.0, "{}", flight.error(&found).0);
        assert_eq!(found.resets, 1, "and it has jumped");
    }
}

/// The odometry's biases are no measurement. A start in the air uses them as initial values, unless they are implausible.
#[test]
fn the_bias_of_the_odometry_is_what_a_start_begins_with() {
    let flight = Flight::new(12, 3);
    for strategy in StrategyKind::ALL {
        let end_m = |bias: Option<ImuBias>| {
            let mut estimator = estimator(*strategy);
            add_all(&mut estimator, &flight.samples[..200]);
            ignore(estimator.add_vio(VioOutput { bias, ..flight.vio[5] }));
            estimator.warm_start(flight.warm_start(SECOND)).unwrap();
            add_all(&mut estimator, &flight.samples[200..]);
            flight.error(&estimator.predicted(12 * SECOND).unwrap()).0
        };
        let [accelerometer, gyroscope] = flight.biases;
        let (without, with) = (end_m(None), end_m(Some(ImuBias { accelerometer, gyroscope })));
        assert!(with < 0.5 * without, "{strategy:?}: {with} m, {without} m without");
        let absurd = ImuBias { accelerometer: Vector3::repeat(5.0), gyroscope };
        assert_eq!(end_m(Some(absurd)), without, "one that has lost itself says anything");
    }
}

/// Anchors that did not fit the previous estimate do not help the next one to overrule the new estimate.
#[test]
fn a_start_forgets_which_anchors_were_refused() {
    for strategy in StrategyKind::ALL {
        let mut strategy = Strategy::<Provided>::new(&config(*strategy)).unwrap();
        let start =
            Start::at(SECOND, (Vector3::zeros(), 1.0), (Vector3::zeros(), 0.1), (UnitQuaternion::identity(), 0.01));
        strategy.start(&start).unwrap();
        let far = AbsolutePose {
            position: Vector3::repeat(900.0),
            world_from_body: UnitQuaternion::identity(),
            position_covariance: Matrix3::identity(),
            rotation_covariance: Matrix3::identity(),
        };
        let refused = strategy.measure(&Measured::Anchor(far));
        assert!(is_gated(&refused), "{refused:?}");
        assert_eq!(strategy.streams().anchors.counts().gate_in_a_row, 1);
        strategy.start(&Start { time_ns: 2 * SECOND, ..start }).unwrap();
        assert_eq!(strategy.streams().anchors.counts().gate_in_a_row, 0);
    }
}

/// A height that has drifted with the IMU alone is not fatal: the receiver provides the right one.
#[test]
fn a_height_that_drifted_away_is_corrected() {
    let flight = Flight::new(12, 3);
    for strategy in StrategyKind::ALL {
        let mut estimator = estimator(*strategy);
        let low = |position: Geodetic| Geodetic { height: position.height - 10_490.0, ..position };
        let start = flight.warm_start(0);
        estimator.warm_start(FlightControllerState { position: low(start.position), ..start }).unwrap();
        let mut was_outside = false;
        for sent in &flight.sent(false, false, true) {
            match sent {
                // It falls by about 50 m, or appears to.
                Sent::Imu(sample) if sample.time_ns < 3 * SECOND => {
                    let specific_force = sample.specific_force - Vector3::z() * 12.0;
                    estimator.add_imu(&ImuMean { specific_force, ..*sample }).unwrap();
                }
                Sent::Fix(fix) if fix.time_ns < 3 * SECOND => continue,
                Sent::Fix(fix) => ignore(estimator.add_gnss(GnssReading { position: low(fix.position), ..*fix })),
                sent => sent.to(&mut estimator).unwrap(),
            }
            assert_ne!(estimator.health().state, HealthState::Lost, "{strategy:?} at {}", sent.time_ns());
            was_outside |= estimator.predicted(sent.time_ns()).is_none();
        }
        assert!(was_outside, "{strategy:?}: nothing is said of where nothing flies");
        let found = estimator.predicted(12 * SECOND).unwrap().position.height;
        let truth = low(flight.frame.geodetic(&Flight::truth(12 * SECOND).position)).height;
        assert!((found - truth).abs() < 20.0, "{strategy:?}: {found} m, {truth} m");
    }
}
