//! The requirements of the interface.

use super::flight::{FRAME, SECOND, STEP};
use super::*;
use crate::navigation::geodesy::Geodetic;
use crate::navigation::{GnssPosition, ImuMean, NavigationFactor};
use nalgebra::{UnitQuaternion, Vector3};

/// Returns a sample at rest, 1 g upwards.
fn at_rest(time_ns: i64) -> ImuMean {
    ImuMean { time_ns, angular_velocity: Vector3::zeros(), specific_force: Vector3::new(0.0, 0.0, 9.80665) }
}

fn played(strategy: StrategyKind, seconds: i64) -> (Flight, Estimator) {
    let flight = Flight::new(seconds, 1);
    let mut estimator = started(&flight, strategy);
    for sent in &flight.sent(true, true, false) {
        sent.to(&mut estimator).unwrap();
    }
    (flight, estimator)
}

#[test]
fn strategies_are_chosen_by_configuration() {
    assert_eq!(StrategyKind::default(), StrategyKind::ALL[0]);
    for strategy in StrategyKind::ALL {
        assert_eq!(StrategyKind::named(strategy.name()), Some(*strategy));
        let estimator = estimator(*strategy);
        assert_eq!(estimator.sink()[0].kind, EventKind::Ready { strategy: *strategy, window: 15 });
    }
    #[cfg(feature = "smoother")]
    assert_eq!(StrategyKind::default(), StrategyKind::FixedLagSmoother);
    assert_eq!(StrategyKind::named("gtsam"), None);
    let params = StateEstimatorParams { window: 1, ..StateEstimatorParams::default() };
    let refused = FlightNavigator::<()>::new(StateEstimatorConfig { params, ..Default::default() }, ());
    assert_eq!(refused.unwrap_err().to_string(), "`window` is 1: choose a value from 2 to 100");
}

#[test]
fn a_flight_is_followed_by_every_strategy() {
    for strategy in StrategyKind::ALL {
        let flight = Flight::new(40, 1);
        let mut estimator = started(&flight, *strategy);
        let mut errors = Vec::new();
        for sent in &flight.sent(true, true, false) {
            sent.to(&mut estimator).unwrap();
            if let (Sent::Imu(sample), true) = (sent, sent.time_ns() > 10 * SECOND)
                && let Some(output) = estimator.tick(sample.time_ns)
            {
                errors.push(flight.error(&output));
            }
        }
        let rms = |pick: fn(&(f64, f64)) -> f64| {
            (errors.iter().map(|error| pick(error).powi(2)).sum::<f64>() / errors.len() as f64).sqrt()
        };
        let (position, rotation) = (rms(|error| error.0), rms(|error| error.1));
        println!("{}: {position} m, {rotation} rad, {} outputs", strategy.name(), errors.len());
        assert!(position < 1.3 && rotation < 0.01, "{}: {position} m, {rotation} rad", strategy.name());
        assert_eq!(errors.len(), 150, "five a second");
    }
}

#[test]
fn set_takeoff_origin_starts_levelled_by_the_flight_controller() {
    let origin = TakeoffOrigin::new(Geodetic::from_degrees(48.0, 11.0, 500.0));
    assert_eq!((origin.horizontal_deviation, origin.vertical_deviation), (5.0, 10.0));
    for strategy in StrategyKind::ALL {
        let mut estimator = estimator(*strategy);
        estimator.set_takeoff_origin(origin).unwrap();
        let heading = UnitQuaternion::from_euler_angles(0.02, -0.03, 1.0);
        let attitude = AttitudeReading {
            time_ns: 10 * STEP,
            world_from_body: heading,
            tilt_deviation: 0.01,
            heading_deviation: 0.1,
        };
        for i in 1..=20 {
            estimator.add_imu(&at_rest(i * STEP)).unwrap();
        }
        assert_eq!(estimator.health().state, HealthState::Init);
        assert!(estimator.current_estimate().is_none() && estimator.tick(20 * STEP).is_none());
        estimator.add_attitude(attitude).unwrap();
        estimator.add_imu(&at_rest(21 * STEP)).unwrap();
        let start = estimator.predicted(21 * STEP).unwrap();
        assert!(start.world_from_body.angle_to(&heading) < 0.001);
        let sigma = |i: usize| start.covariance[(i, i)].sqrt();
        assert!((sigma(0) - 5.0).abs() < 0.01 && (sigma(1) - 5.0).abs() < 0.01 && (sigma(2) - 10.0).abs() < 0.01);
        let moved = estimator.set_takeoff_origin(origin);
        assert_eq!(moved, Err(OriginError::AfterMeasurement));
        let started = EventKind::Started { from: StartedFrom::Origin };
        assert!(
            kinds(estimator.sink(), "started").map(|event| (event.time_ns, event.kind)).eq([(11 * STEP, started)])
        );
    }
}

/// The flight controller reports it before the first sample comes.
#[test]
fn an_attitude_from_before_the_first_sample_levels_the_start() {
    let world_from_body = UnitQuaternion::from_euler_angles(0.0, 0.0, 1.0);
    for strategy in StrategyKind::ALL {
        let mut estimator = estimator(*strategy);
        let origin = Geodetic::from_degrees(48.0, 11.0, 500.0);
        estimator.set_takeoff_origin(TakeoffOrigin::new(origin)).unwrap();
        let (tilt_deviation, heading_deviation) = (0.01, 0.1);
        let attitude = AttitudeReading { time_ns: 0, world_from_body, tilt_deviation, heading_deviation };
        assert_eq!(estimator.add_attitude(attitude), Ok(Added::Waits));
        assert_eq!(
            estimator.add_gps_health(GpsHealthReading { time_ns: 0, health: GpsHealth::Spoofed }),
            Ok(Added::Waits)
        );
        (1..=3).for_each(|i| estimator.add_imu(&at_rest(i * STEP)).unwrap());
        let started = estimator.predicted(3 * STEP).unwrap();
        assert!(started.world_from_body.angle_to(&world_from_body) < 1e-3, "{}", strategy.name());
        assert_eq!((count(estimator.sink(), "degraded"), estimator.health().gate), (0, GateState::Blocked));
    }
}

#[test]
fn without_an_attitude_rest_levels_the_start() {
    for strategy in StrategyKind::ALL {
        let mut estimator = estimator(*strategy);
        let position = Geodetic::from_degrees(-33.0, 151.0, 20.0);
        let unknown = TakeoffOrigin { horizontal_deviation: f64::NAN, ..TakeoffOrigin::new(position) };
        let refused = OriginError::Refused(crate::navigation::Refusal::Noise);
        assert_eq!(estimator.set_takeoff_origin(unknown), Err(refused));
        estimator.set_takeoff_origin(TakeoffOrigin::new(position)).unwrap();
        (1..=250).for_each(|i| estimator.add_imu(&at_rest(i * STEP)).unwrap());
        let start = estimator.predicted(250 * STEP).unwrap();
        assert!(start.world_from_body.angle() < 1e-6 && start.velocity.norm() < 1e-6);
        assert!((start.position.latitude - position.latitude).abs() < 1e-9);
    }
}

#[test]
fn a_warm_start_inflates_what_the_flight_controller_says() {
    let flight = Flight::new(2, 1);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        let start = estimator.predicted(STEP).unwrap();
        // 1 m, doubled, and 0.03 rad, doubled.
        assert!((start.covariance[(0, 0)].sqrt() - 2.0).abs() < 0.01, "{}", start.covariance[(0, 0)].sqrt());
        assert!((start.covariance[(5, 5)].sqrt() - 0.06).abs() < 1e-3);
        let (position, rotation) = flight.error(&start);
        assert!(position < 1.2 && rotation < 0.03);
        let event = kinds(estimator.sink(), "started").next().unwrap();
        assert_eq!(
            (event.kind, event.level()),
            (EventKind::Started { from: StartedFrom::FlightController }, Level::Info)
        );
        let again = estimator.warm_start(flight.warm_start(STEP));
        assert_eq!(again, Err(EstimatorError::Degraded(Reason::Duplicate)), "it runs");
    }
}

#[test]
fn an_anchor_starts_what_has_no_origin() {
    let flight = Flight::new(3, 1);
    for strategy in StrategyKind::ALL {
        let mut estimator = estimator(*strategy);
        flight.samples.iter().for_each(|sample| estimator.add_imu(sample).unwrap());
        estimator.add_pose_anchor(flight.anchors[1]).unwrap();
        assert!(flight.error(&estimator.predicted(3 * SECOND).unwrap()).1 < 0.1);
        assert_eq!(
            kinds(estimator.sink(), "started").next().unwrap().kind,
            EventKind::Started { from: StartedFrom::Anchor }
        );
    }
}

#[test]
fn add_vio_and_add_pose_anchor_say_what_became_of_them() {
    let flight = Flight::new(4, 1);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        assert_eq!(estimator.add_vio(flight.vio[0]), Ok(Added::Waits), "the IMU is not there yet");
        for sample in flight.samples.iter().skip(1).take(60) {
            estimator.add_imu(sample).unwrap();
        }
        assert!(matches!(estimator.add_vio(flight.vio[1]), Ok(Added::Taken { nis: Some(nis) }) if nis < 5.0));
        let again = estimator.add_vio(flight.vio[1]);
        assert_eq!(again, Err(EstimatorError::Degraded(Reason::Duplicate)));
        // The filter holds only the camera's last frame. The window has the other one too, and finds that it does not fit.
        let skipped = estimator.add_vio(VioOutput { from_ns: STEP, ..flight.vio[2] });
        let Err(EstimatorError::Degraded(Reason::Refused(refusal))) = skipped else { panic!("{skipped:?}") };
        match refusal {
            crate::navigation::Refusal::NoKeyframe { .. } => assert!(!estimator.is_smoothing()),
            crate::navigation::Refusal::Gate { .. } => assert!(estimator.is_smoothing()),
            _ => panic!("{refusal:?}"),
        }
        let anchor = PoseAnchor { time_ns: 30 * STEP, ..flight.anchors[2] };
        // Three seconds too early, it is far off.
        assert!(matches!(
            estimator.add_pose_anchor(anchor),
            Err(EstimatorError::Degraded(Reason::Refused(crate::navigation::Refusal::Gate { .. })))
        ));
    }
}

#[test]
fn factors_of_a_provider_are_added_to_the_same_window() {
    let flight = Flight::new(3, 1);
    for strategy in StrategyKind::ALL {
        let [without, with] = [false, true].map(|adds| {
            let mut estimator = started(&flight, *strategy);
            flight.samples[1..].iter().for_each(|sample| estimator.add_imu(sample).unwrap());
            flight.vio.iter().for_each(|vio| ignore(estimator.add_vio(*vio)));
            if adds {
                for i in 11..=25 {
                    let time_ns = i * FRAME;
                    let position = estimator
                        .frame()
                        .unwrap()
                        .position(&flight.frame.geodetic(&Flight::truth(time_ns).position));
                    let factor = NavigationFactor::from(GnssPosition::new(position, 0.1, 0.1));
                    assert!(matches!(estimator.add_factor(time_ns, 1, factor), Ok(Added::Taken { nis: Some(_) })));
                    assert_eq!(
                        estimator.add_factor(time_ns, 1, factor),
                        Err(EstimatorError::Degraded(Reason::Duplicate))
                    );
                    assert!(estimator.add_factor(time_ns, 2, factor).is_ok(), "another provider");
                }
            }
            flight.error(&estimator.predicted(3 * SECOND).unwrap()).0
        });
        assert!(with < 0.1 && with < 0.2 * without, "{}: {with} m, {without} m without", strategy.name());
    }
}

#[test]
fn add_fc_imu_takes_all_that_the_flight_controller_sends() {
    let flight = Flight::new(6, 1);
    for strategy in StrategyKind::ALL {
        let mut estimator = estimator(*strategy);
        estimator.warm_start(flight.warm_start(0)).unwrap();
        let attitudes = [flight.warm_start(STEP).attitude];
        for (i, imu) in flight.samples.chunks(40).enumerate() {
            let window = FlightControllerWindow {
                imu,
                attitudes: &attitudes[i.min(1)..],
                health: &flight.health[i..=i],
                fixes: if i == 0 { &[] } else { &flight.fixes[i - 1..i] },
            };
            estimator.add_fc_imu(&window).unwrap();
        }
        assert_eq!(estimator.label(), SourceLabel::SatelliteAnchored, "by fixes that are trusted");
        assert!(flight.error(&estimator.predicted(6 * SECOND).unwrap()).0 < 2.0);
        let mut imu = flight.samples[flight.samples.len() - 1];
        imu.time_ns += STEP;
        imu.specific_force.x = f64::NAN;
        let window = FlightControllerWindow { imu: &[imu], ..FlightControllerWindow::default() };
        let refused = EstimatorError::Degraded(Reason::Refused(crate::navigation::Refusal::NonFinite));
        assert_eq!(estimator.add_fc_imu(&window), Err(refused));
        assert_eq!(estimator.counts().invalid, 1);
    }
}

#[test]
fn current_estimate_is_the_newest_keyframe_and_the_history_says_whether_it_is_smoothed() {
    for strategy in StrategyKind::ALL {
        let (flight, mut estimator) = played(*strategy, 8);
        let newest = estimator.current_estimate().unwrap();
        assert_eq!((newest.time_ns, newest.smoothed), (8 * SECOND, false));
        assert!(flight.error(&newest).0 < 3.0);
        assert_eq!((newest.label, newest.anchor_age_ms), (SourceLabel::SatelliteAnchored, Some(985)));
        let history = estimator.smoothed_history(5);
        let times: Vec<i64> = history.iter().map(|past| past.time_ns).collect();
        assert_eq!(times, [1, 2, 3, 4, 5].map(|i| 8 * SECOND - i * FRAME));
        assert!(history.iter().all(|past| past.smoothed == strategy.is_smoothing() && flight.error(past).0 < 3.0));
        assert_eq!(estimator.smoothed_history(1000).len(), 14, "a window of 15");
        assert_eq!(estimator.health().keyframes, 15);
    }
}

/// Later measurements correct the smoother's keyframes, but not the filter's.
#[test]
fn history_of_the_smoother_is_better_than_that_of_the_filter() {
    for strategy in StrategyKind::ALL {
        let (flight, mut estimator) = played(*strategy, 8);
        let before = estimator.smoothed_history(3);
        let time_ns = 8 * SECOND;
        let truth = flight.frame.geodetic(&Flight::truth(time_ns).position);
        let position = estimator.frame().unwrap().position(&truth);
        estimator.add_factor(time_ns, 1, GnssPosition::new(position, 0.05, 0.05).into()).unwrap();
        let after = estimator.smoothed_history(3);
        for (before, after) in before.iter().zip(&after) {
            let [before_m, after_m] = [before, after].map(|past| flight.error(past).0);
            if strategy.is_smoothing() {
                assert!(after_m < 0.5 * before_m, "{after_m} m was {before_m} m");
            } else {
                assert_eq!(after, before);
            }
        }
    }
}

#[test]
fn outputs_come_at_their_rate_predicted_to_the_moment_of_emission() {
    let flight = Flight::new(6, 1);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        let mut outputs = Vec::new();
        for sent in &flight.sent(true, true, false) {
            sent.to(&mut estimator).unwrap();
            // The caller's own clock, 1 ms after the sample.
            if let Sent::Imu(sample) = sent {
                outputs.extend(estimator.tick(sample.time_ns + 1_000_000));
            }
        }
        let intervals: Vec<i64> = outputs.windows(2).map(|two| two[1].emitted_ns - two[0].emitted_ns).collect();
        assert!(intervals.iter().all(|interval| *interval == SECOND / 5), "{intervals:?}");
        let mut ids: Vec<_> = outputs.iter().map(|output| output.frame_id).collect();
        ids.dedup();
        assert_eq!(ids.len(), 30);
        for output in &outputs {
            assert_eq!(output.emitted_ns, output.time_ns, "predicted to the moment of emission");
            assert!(!output.smoothed && output.quality.label == output.label);
            assert_eq!(output.quality.covariance_norm, output.covariance.norm());
            assert_eq!(output.quality.anchor_age_ms, output.anchor_age_ms);
            // At 25 m/s, 0.2 s without prediction would be 5 m.
            assert!(flight.error(output).0 < 4.0);
        }
        assert!(outputs.last().unwrap().quality.nis.is_some());
    }
}

#[test]
fn a_degraded_covariance_of_the_provider_is_in_the_quality() {
    let flight = Flight::new(6, 1);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        for sent in &flight.sent(true, true, false) {
            match sent {
                Sent::Anchor(anchor) => {
                    let anchor = PoseAnchor { is_covariance_degraded: anchor.time_ns > 3 * SECOND, ..*anchor };
                    estimator.add_pose_anchor(anchor).unwrap();
                }
                sent => sent.to(&mut estimator).unwrap(),
            }
            if let Some(output) = estimator.tick(sent.time_ns()) {
                assert_eq!(output.quality.is_anchor_degraded, output.time_ns > 3 * SECOND + 3 * STEP);
                assert!(!output.degraded);
            }
        }
    }
}

/// A flight of 60 km: the world's origin moves eleven times.
#[test]
fn the_world_moves_on_with_the_robot() {
    for strategy in StrategyKind::ALL {
        let mut estimator = estimator(*strategy);
        let flight = Flight::new(2, 1);
        let start = Geodetic::from_degrees(48.0, 11.0, 500.0);
        let velocity = Vector3::new(0.0, 400.0, 0.0);
        estimator
            .warm_start(FlightControllerState {
                position: start,
                velocity,
                attitude: AttitudeReading {
                    world_from_body: UnitQuaternion::identity(),
                    ..flight.warm_start(0).attitude
                },
                ..flight.warm_start(0)
            })
            .unwrap();
        for i in 1..=1500 {
            let time_ns = i * SECOND / 10;
            estimator.add_imu(&ImuMean { time_ns, ..at_rest(0) }).unwrap();
            // North along the meridian, about 6,366 km from the centre of curvature, as measured by anchors.
            let latitude = start.latitude + 400.0 * (time_ns as f64 * 1e-9) / 6_366_000.0;
            let mut anchor = flight.anchors[0];
            anchor.time_ns = time_ns;
            anchor.position = Geodetic { latitude, ..start };
            anchor.world_from_body = UnitQuaternion::identity();
            let _ = estimator.add_pose_anchor(anchor);
        }
        let output = estimator.predicted(150 * SECOND).unwrap();
        assert!((output.position.height - 500.0).abs() < 3.0, "{} m high", output.position.height);
        assert!(output.world_from_body.angle() < 0.02, "level where it is, {} rad", output.world_from_body.angle());
        let from_frame = estimator.frame().unwrap().position(&output.position);
        assert!(from_frame.xy().norm() <= 5100.0, "{from_frame}");
    }
}
