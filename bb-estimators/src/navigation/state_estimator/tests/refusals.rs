//! Each reason for which an input is not in the estimate is provoked, counted and reported.

use super::flight::{FRAME, SECOND, STEP};
use super::strategy::{Measured, Strategy};
use super::*;
use crate::navigation::eskf::Start;
use crate::navigation::geodesy::Geodetic;
use crate::navigation::{AbsolutePose, GnssPosition, Refusal};
use nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector3};

/// Two seconds of flight, without anchors.
fn flown(flight: &Flight, strategy: StrategyKind) -> Providing {
    let mut estimator: Providing = FlightNavigator::new(config(strategy), Events::new()).unwrap();
    estimator.warm_start(flight.warm_start(0)).unwrap();
    for sample in &flight.samples[..400] {
        estimator.add_imu(sample).unwrap();
    }
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
        flight.samples[..200].iter().for_each(|sample| cold.add_imu(sample).unwrap());
        assert_eq!(refused(cold.add_vio(flight.vio[4])), Refusal::NotStarted);

        let mut estimator = flown(&flight, *strategy);
        let zero = Matrix6::zeros();
        let off = flight.frame.geodetic(&(flight.frame.position(&anchor.position) + Vector3::x() * 90.0));
        let bias = ImuBias { accelerometer: Vector3::repeat(20.0), gyroscope: Vector3::zeros() };
        let nan = Vector3::repeat(f64::NAN);
        assert_eq!(refused(estimator.add_vio(VioOutput { translation: nan, ..vio })), Refusal::NonFinite);
        assert_eq!(refused(estimator.add_vio(VioOutput { bias: Some(bias), ..vio })), Refusal::OutOfRange);
        assert_eq!(refused(estimator.add_pose_anchor(PoseAnchor { covariance: zero, ..anchor })), Refusal::Noise);
        let (previous_ns, time_ns) = (vio.to_ns, vio.from_ns);
        let back = VioOutput { from_ns: vio.to_ns, to_ns: vio.from_ns, ..vio };
        assert_eq!(refused(estimator.add_vio(back)), Refusal::TimeNotIncreasing { previous_ns, time_ns });
        let far = refused(estimator.add_pose_anchor(PoseAnchor { position: off, ..anchor }));
        assert!(matches!(far, Refusal::Gate { nis, limit } if nis > limit), "{far:?}");
        let unknown = refused(estimator.add_vio(VioOutput { from_ns: 3 * STEP, ..vio }));
        assert!(matches!(unknown, Refusal::NoKeyframe { .. }), "{unknown:?}");
        let blind = refused(estimator.add_factor(2 * SECOND - STEP, 0, Provided::Nothing));
        assert_eq!(blind, Refusal::NotObservable);
        let elsewhere = refused(estimator.add_factor(2 * SECOND - STEP, 1, Provided::Elsewhere));
        assert_eq!(elsewhere, Refusal::OutOfRange, "what a provider refuses is not the end of the estimate");
        for (provider, factor) in [(2, Provided::Unset), (3, Provided::Unnamed)] {
            let useless = refused(estimator.add_factor(2 * SECOND - STEP, provider, factor));
            assert_eq!(useless, Refusal::NotObservable, "{}: {factor:?}", strategy.name());
        }
        let old = PoseAnchor { time_ns: -SECOND, ..anchor };
        assert_eq!(refused(estimator.add_pose_anchor(old)), Refusal::TooOld { time_ns: -SECOND });
        let ahead = PoseAnchor { time_ns: 3 * SECOND, ..anchor };
        assert_eq!(refused(estimator.add_pose_anchor(ahead)), Refusal::InTheFuture { time_ns: 3 * SECOND });
        let again = estimator.add_vio(flight.vio[3]);
        assert_eq!(again, Err(EstimatorError::Degraded(Reason::Duplicate)));

        let counts = *estimator.counts();
        let counted = [counts.invalid, counts.too_old, counts.in_the_future, counts.duplicates];
        assert_eq!(counted, [4, 1, 1, 1]);
        // The frame 15 ms after the start also separates the two of the first relative pose, which was in the estimate: the filter holds
        // only the last frame, and the window both.
        let first_ns = flight.vio[0].to_ns;
        let told: Vec<i64> = kinds(estimator.sink(), "degraded").map(|event| event.time_ns).collect();
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
        assert_eq!(full.count(), expected, "{}", strategy.name());
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
            let broken = crate::navigation::ImuMean { specific_force: Vector3::new(0.0, 0.0, 900.0), ..*sample };
            ignore(estimator.add_imu(&broken));
            if estimator.health().state == HealthState::Lost {
                lost_ns.get_or_insert(sample.time_ns);
            }
        }
        let lost_ns = lost_ns.unwrap();
        // 10 km/s at 890 m/s².
        assert!((lost_ns - 13 * SECOND).abs() < SECOND, "{}: {lost_ns}", strategy.name());
        let fatal: Vec<_> = kinds(estimator.sink(), "fatal").map(|event| event.kind).collect();
        let reason = Reason::Refused(Refusal::OutOfRange);
        assert_eq!(fatal, [EventKind::Fatal { input: InputKind::Imu, reason }], "once");
        let state = flight.warm_start(30 * SECOND);
        assert!(estimator.warm_start(state).is_ok(), "it takes what the flight controller knows");
        flight.samples[6000..].iter().for_each(|sample| estimator.add_imu(sample).unwrap());
        let found = estimator.predicted(40 * SECOND).unwrap();
        assert!(flight.error(&found).0 < 30.0, "{}", flight.error(&found).0);
        assert_eq!(found.resets, 1, "and it has jumped");
    }
}

#[test]
fn health_goes_through_all_its_states() {
    let flight = Flight::new(12, 3);
    for strategy in StrategyKind::ALL {
        let mut estimator = estimator(*strategy);
        let health = estimator.health();
        assert_eq!((health.state, health.keyframes, health.covariance_growing_s), (HealthState::Init, 0, 0.0));
        assert!(health.gate.is_open() && !health.is_fallback_engaged);
        estimator.warm_start(flight.warm_start(0)).unwrap();
        let mut states = Vec::new();
        for sent in &flight.sent(true, true, false) {
            // Half a second without the IMU.
            let is_missing = matches!(sent, Sent::Imu(_)) && (4 * SECOND..9 * SECOND / 2).contains(&sent.time_ns());
            if !is_missing {
                ignore(sent.to(&mut estimator));
            }
            if sent.time_ns() <= 9 * SECOND {
                estimator.tick(sent.time_ns());
            }
            states.push(estimator.health().state);
        }
        // The IMU is silent.
        for i in 0..20 {
            estimator.tick(12 * SECOND + i * 2 * FRAME);
        }
        states.push(estimator.health().state);
        states.dedup();
        use HealthState::{Degraded, Lost, Tracking};
        assert_eq!(states.first(), Some(&Tracking));
        assert!(states.contains(&Degraded), "{states:?}");
        assert_eq!(states.last(), Some(&Lost), "{states:?}");
        assert!(estimator.health().is_fallback_engaged && estimator.health().keyframes == 15);
    }
}

/// The odometry's biases are no measurement. A start in the air uses them as initial values, unless they are implausible.
#[test]
fn the_bias_of_the_odometry_is_what_a_start_begins_with() {
    let flight = Flight::new(12, 3);
    for strategy in StrategyKind::ALL {
        let end_m = |bias: Option<ImuBias>| {
            let mut estimator = estimator(*strategy);
            flight.samples[..200].iter().for_each(|sample| estimator.add_imu(sample).unwrap());
            ignore(estimator.add_vio(VioOutput { bias, ..flight.vio[5] }));
            estimator.warm_start(flight.warm_start(SECOND)).unwrap();
            flight.samples[200..].iter().for_each(|sample| estimator.add_imu(sample).unwrap());
            flight.error(&estimator.predicted(12 * SECOND).unwrap()).0
        };
        let [accelerometer, gyroscope] = flight.biases;
        let (without, with) = (end_m(None), end_m(Some(ImuBias { accelerometer, gyroscope })));
        assert!(with < 0.5 * without, "{}: {with} m, {without} m without", strategy.name());
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
        let Err(EstimatorError::Degraded(Reason::Refused(Refusal::Gate { .. }))) = refused else {
            panic!("{refused:?}")
        };
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
        let mut estimator: Estimator = estimator(*strategy);
        let low = |position: Geodetic| Geodetic { height: position.height - 10_490.0, ..position };
        let start = flight.warm_start(0);
        estimator.warm_start(FlightControllerState { position: low(start.position), ..start }).unwrap();
        let mut was_outside = false;
        for sent in &flight.sent(false, false, true) {
            match sent {
                // It falls by about 50 m, or appears to.
                Sent::Imu(sample) if sample.time_ns < 3 * SECOND => {
                    let less = crate::navigation::ImuMean {
                        specific_force: sample.specific_force - Vector3::z() * 12.0,
                        ..*sample
                    };
                    estimator.add_imu(&less).unwrap();
                }
                Sent::Fix(fix) if fix.time_ns < 3 * SECOND => continue,
                Sent::Fix(fix) => ignore(estimator.add_gnss(GnssReading { position: low(fix.position), ..*fix })),
                sent => sent.to(&mut estimator).unwrap(),
            }
            assert_ne!(estimator.health().state, HealthState::Lost, "{} at {}", strategy.name(), sent.time_ns());
            was_outside |= estimator.predicted(sent.time_ns()).is_none();
        }
        assert!(was_outside, "{}: nothing is said of where nothing flies", strategy.name());
        let found = estimator.predicted(12 * SECOND).unwrap().position.height;
        let truth = low(flight.frame.geodetic(&Flight::truth(12 * SECOND).position)).height;
        assert!((found - truth).abs() < 20.0, "{}: {found} m, {truth} m", strategy.name());
    }
}
