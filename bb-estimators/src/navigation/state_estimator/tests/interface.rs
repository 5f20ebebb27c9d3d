//! The requirements of the interface.

use super::*;

/// Returns a sample at rest, 1 g upwards.
fn at_rest(time_ns: i64) -> ImuMean {
    ImuMean { time_ns, angular_velocity: Vector3::zeros(), specific_force: Vector3::new(0.0, 0.0, 9.80665) }
}

fn leveled(time_ns: i64, world_from_body: UnitQuaternion<f64>) -> AttitudeReading {
    AttitudeReading { time_ns, world_from_body, tilt_deviation: 0.01, heading_deviation: 0.1 }
}

/// Times and sources of the starts, each of which is told with the level info.
fn started_from(estimator: &Estimator) -> Vec<(i64, StartedFrom)> {
    let start = |event: &Event| match (event.kind, event.level()) {
        (EventKind::Started { from }, Level::Info) => (event.time_ns, from),
        other => panic!("{other:?}"),
    };
    kinds(estimator.sink(), "started").map(start).collect()
}

fn played(strategy: StrategyKind, seconds: i64) -> (Flight, Estimator) {
    let flight = Flight::new(seconds, 1);
    let mut estimator = started(&flight, strategy);
    flight.sent(true, true, false).iter().for_each(|sent| sent.to(&mut estimator).unwrap());
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
fn a_flight_is_followed_by_outputs_at_their_rate_predicted_to_the_moment_of_emission() {
    for (strategy, flight, mut estimator) in flights(40, 1) {
        let mut outputs = Vec::new();
        for sent in &flight.sent(true, true, false) {
            sent.to(&mut estimator).unwrap();
            // The caller's own clock, 1 ms after the sample.
            if let Sent::Imu(sample) = sent {
                outputs.extend(estimator.tick(sample.time_ns + 1_000_000));
            }
        }
        assert_eq!(outputs.len(), 200, "five a second");
        for [one, next] in outputs.array_windows() {
            assert_eq!(next.emitted_ns - one.emitted_ns, SECOND / 5);
            assert_ne!(next.frame_id, one.frame_id);
        }
        for output in &outputs {
            assert_eq!(output.emitted_ns, output.time_ns, "predicted to the moment of emission");
            assert!(!output.smoothed && output.quality.label == output.label);
            assert_eq!(output.quality.covariance_norm, output.covariance.norm());
            assert_eq!(output.quality.anchor_age_ms, output.anchor_age_ms);
            // At 25 m/s, 0.2 s without prediction would be 5 m.
            assert!(flight.error(output).0 < 4.0);
        }
        assert!(outputs.last().unwrap().quality.nis.is_some());
        let late = &outputs[50..];
        let rms = |error: &dyn Fn(&EstimatorOutput) -> f64| {
            (late.iter().map(|output| error(output).powi(2)).sum::<f64>() / late.len() as f64).sqrt()
        };
        let (position, rotation) = (rms(&|output| flight.error(output).0), rms(&|output| flight.error(output).1));
        assert!(position < 1.3 && rotation < 0.01, "{strategy:?}: {position} m, {rotation} rad");
        // It flies at 15 to 30 m/s in all directions.
        let velocity = late.iter().map(|output| flight.velocity_error(output)).fold(0.0, f64::max);
        assert!(velocity < 0.5, "{strategy:?}: {velocity} m/s");
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
        let attitude = leveled(10 * STEP, heading);
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
        assert_eq!(started_from(&estimator), [(11 * STEP, StartedFrom::Origin)]);
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
        assert_eq!(estimator.add_attitude(leveled(0, world_from_body)), Ok(Added::Waits));
        let spoofed = GpsHealthReading { time_ns: 0, health: GpsHealth::Spoofed };
        assert_eq!(estimator.add_gps_health(spoofed), Ok(Added::Waits));
        (1..=3).for_each(|i| estimator.add_imu(&at_rest(i * STEP)).unwrap());
        let started = estimator.predicted(3 * STEP).unwrap();
        assert!(started.world_from_body.angle_to(&world_from_body) < 1e-3, "{strategy:?}");
        assert_eq!((count(estimator.sink(), "degraded"), estimator.health().gate), (0, GateState::Blocked));
    }
}

#[test]
fn without_an_attitude_rest_levels_the_start() {
    for strategy in StrategyKind::ALL {
        let mut estimator = estimator(*strategy);
        let position = Geodetic::from_degrees(-33.0, 151.0, 20.0);
        let unknown = TakeoffOrigin { horizontal_deviation: f64::NAN, ..TakeoffOrigin::new(position) };
        let refused = OriginError::Refused(Refusal::Noise);
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
    for (_, flight, mut estimator) in flights(2, 1) {
        let start = estimator.predicted(STEP).unwrap();
        // 1 m, doubled, and 0.03 rad, doubled.
        assert!((start.covariance[(0, 0)].sqrt() - 2.0).abs() < 0.01, "{}", start.covariance[(0, 0)].sqrt());
        assert!((start.covariance[(5, 5)].sqrt() - 0.06).abs() < 1e-3);
        let (position, rotation) = flight.error(&start);
        assert!(position < 1.2 && rotation < 0.03);
        assert!(matches!(started_from(&estimator)[..], [(_, StartedFrom::FlightController)]));
        let again = estimator.warm_start(flight.warm_start(STEP));
        assert_eq!(again, degraded(Reason::Duplicate), "it runs");
    }
}

#[test]
fn an_anchor_starts_what_has_no_origin() {
    let flight = Flight::new(3, 1);
    for strategy in StrategyKind::ALL {
        let mut estimator = estimator(*strategy);
        add_all(&mut estimator, &flight.samples);
        estimator.add_pose_anchor(flight.anchors[1]).unwrap();
        assert!(flight.error(&estimator.predicted(3 * SECOND).unwrap()).1 < 0.1);
        assert!(matches!(started_from(&estimator)[..], [(_, StartedFrom::Anchor)]));
    }
}

#[test]
fn add_vio_and_add_pose_anchor_say_what_became_of_them() {
    for (_, flight, mut estimator) in flights(4, 1) {
        assert_eq!(estimator.add_vio(flight.vio[0]), Ok(Added::Waits), "the IMU is not there yet");
        add_all(&mut estimator, &flight.samples[1..61]);
        assert!(matches!(estimator.add_vio(flight.vio[1]), Ok(Added::Taken { nis: Some(nis) }) if nis < 5.0));
        let again = estimator.add_vio(flight.vio[1]);
        assert_eq!(again, degraded(Reason::Duplicate));
        // The filter holds only the camera's last frame. The window has the other one too, and finds that it does not fit.
        let skipped = estimator.add_vio(VioOutput { from_ns: STEP, ..flight.vio[2] });
        let no_keyframe = Reason::Refused(Refusal::NoKeyframe { id: STEP as u64 ^ (1 << 63) });
        match estimator.is_smoothing() {
            true => assert!(is_gated(&skipped), "{skipped:?}"),
            false => assert_eq!(skipped, degraded(no_keyframe)),
        }
        // Three seconds too early, it is far off.
        let early = estimator.add_pose_anchor(PoseAnchor { time_ns: 30 * STEP, ..flight.anchors[2] });
        assert!(is_gated(&early), "{early:?}");
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
        let specific_force = Vector3::repeat(f64::NAN);
        let imu = ImuMean { time_ns: 6 * SECOND + STEP, specific_force, ..flight.samples[0] };
        let window = FlightControllerWindow { imu: &[imu], ..FlightControllerWindow::default() };
        assert_eq!(estimator.add_fc_imu(&window), degraded(Refusal::NonFinite));
        assert_eq!(estimator.counts().invalid, 1);
    }
}

#[test]
fn current_estimate_is_the_newest_keyframe_and_the_history_says_whether_it_is_smoothed() {
    for strategy in StrategyKind::ALL {
        let (flight, mut estimator) = played(*strategy, 8);
        let newest = estimator.current_estimate().unwrap();
        assert_eq!((newest.time_ns, newest.smoothed), (8 * SECOND, false));
        assert!(flight.error(&newest).0 < 3.0 && flight.velocity_error(&newest) < 0.5);
        assert_eq!((newest.label, newest.anchor_age_ms), (SourceLabel::SatelliteAnchored, Some(985)));
        let history = estimator.smoothed_history(5);
        let times: Vec<i64> = history.iter().map(|past| past.time_ns).collect();
        assert_eq!(times, [1, 2, 3, 4, 5].map(|i| 8 * SECOND - i * FRAME));
        assert!(history.iter().all(|past| past.smoothed == strategy.is_smoothing() && flight.error(past).0 < 3.0));
        assert_eq!(estimator.smoothed_history(1000).len(), 14, "a window of 15");
        assert_eq!(estimator.health().keyframes, 15);
    }
}

/// Factors are added to the same window: later measurements correct the smoother's keyframes, but not the filter's.
#[test]
fn factors_of_a_provider_correct_the_estimate_and_the_history_of_the_smoother() {
    for strategy in StrategyKind::ALL {
        let (flight, mut estimator) = played(*strategy, 8);
        let (before, time_ns) = (estimator.smoothed_history(3), 8 * SECOND);
        let truth = flight.frame.geodetic(&Flight::truth(time_ns).position);
        let position = estimator.frame().unwrap().position(&truth);
        let factor = NavigationFactor::from(GnssPosition::new(position, 0.05, 0.05));
        assert!(matches!(estimator.add_factor(time_ns, 1, factor), Ok(Added::Taken { nis: Some(_) })));
        assert_eq!(estimator.add_factor(time_ns, 1, factor), degraded(Reason::Duplicate));
        let error_m = flight.off(&estimator.predicted(time_ns).unwrap()).norm();
        assert!(error_m < 0.1, "{strategy:?}: {error_m} m");
        let after = estimator.smoothed_history(3);
        for (before, after) in before.iter().zip(&after) {
            let [before_m, after_m] = [before, after].map(|past| flight.error(past).0);
            match strategy.is_smoothing() {
                true => assert!(after_m < 0.5 * before_m, "{after_m} m was {before_m} m"),
                false => assert_eq!(after, before),
            }
        }
        assert!(estimator.add_factor(time_ns, 2, factor).is_ok(), "another provider");
    }
}
