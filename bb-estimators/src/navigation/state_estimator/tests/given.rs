//! Factors of outside providers that are plain data, and relative poses between any two frames.

use super::*;
use nalgebra::Vector6;

fn pose(flight: &Flight, time_ns: i64) -> (Geodetic, UnitQuaternion<f64>) {
    let truth = Flight::truth(time_ns);
    let position = flight.frame.geodetic(&truth.position);
    let turn = flight.frame.other_from_self(&LocalFrame::new(position)).rotation;
    (position, turn * truth.world_from_body)
}

/// The distances along two directions from where the provider believes the body to be, 3 m off: known to 5 cm.
fn linear(flight: &Flight, time_ns: i64) -> GivenFactor {
    let off = Vector3::new(3.0, -2.0, 1.0);
    let (position, world_from_body) = pose(flight, time_ns);
    let here = LocalFrame::new(position).geodetic(&off);
    let mut jacobian = Matrix6::zeros();
    let mut residual = Vector6::zeros();
    // The rows between are empty.
    for (row, direction) in [(0, Vector3::new(0.6, 0.8, 0.0)), (3, Vector3::new(-0.8, 0.6, 0.0))] {
        jacobian.fixed_view_mut::<1, 3>(row, 0).copy_from(&direction.transpose());
        residual[row] = -direction.dot(&off);
    }
    let covariance = Matrix6::identity() * 0.0025;
    let form = FactorForm::Linear(LinearFactor { position: here, world_from_body, jacobian, residual, covariance });
    GivenFactor { time_ns, provider: 1, form }
}

fn relative(from_ns: i64, time_ns: i64) -> GivenFactor {
    let VioOutput { translation, from_to, covariance, .. } = Flight::relative(from_ns, time_ns);
    let form = FactorForm::Relative(RelativeFactor { from_ns, translation, from_to, covariance });
    GivenFactor { time_ns, provider: 2, form }
}

/// The estimator after three seconds with the camera, and without anchors.
fn flown(flight: &Flight, strategy: StrategyKind) -> Estimator {
    let mut estimator = started(flight, strategy);
    flight.sent(true, false, false).iter().for_each(|sent| sent.to(&mut estimator).unwrap());
    estimator
}

#[test]
fn rows_on_the_pose_are_taken_by_every_strategy() {
    let flight = Flight::new(3, 1);
    for strategy in StrategyKind::ALL {
        let mut estimator = flown(&flight, *strategy);
        for i in 11..=29 {
            // Also between two frames: the camera's relative pose is then one between keyframes that are not neighbours.
            let time_ns = i * FRAME + if i % 2 == 0 { 3 * STEP } else { 0 };
            let taken = estimator.add_given_factor(linear(&flight, time_ns));
            let is_taken = matches!(taken, Ok(Added::Taken { nis: Some(nis) }) if nis < 10.0);
            assert!(is_taken, "{strategy:?} {i}: {taken:?}");
        }
        assert_eq!(count(estimator.sink(), "degraded"), 0, "{strategy:?}");
        let output = estimator.predicted(3 * SECOND).unwrap();
        let off = flight.off(&output);
        let sigma = |i: usize| output.covariance[(i, i)].sqrt();
        assert!(off.xy().norm() < 0.1, "{strategy:?}: {off}");
        assert!(sigma(0) < 0.05 && sigma(1) < 0.05 && sigma(2) > 0.5, "{strategy:?}: {}", output.covariance);
    }
}

/// A full pose is what an anchor is.
#[test]
fn six_rows_are_an_anchor() {
    let flight = Flight::new(3, 1);
    for strategy in StrategyKind::ALL {
        let anchor = flight.anchors[1];
        let PoseAnchor { time_ns, position, world_from_body, covariance, .. } = anchor;
        let (jacobian, residual) = (Matrix6::identity(), Vector6::zeros());
        let form = FactorForm::Linear(LinearFactor { position, world_from_body, jacobian, residual, covariance });
        let [mut one, mut other] = [(); 2].map(|()| flown(&flight, *strategy));
        // Camera frames decide where an anchor is put; a factor is a keyframe itself.
        one.add_pose_anchor(PoseAnchor { time_ns: 20 * FRAME, ..anchor }).unwrap();
        other.add_given_factor(GivenFactor { time_ns: 20 * FRAME, provider: 0, form }).unwrap();
        assert!(time_ns > 20 * FRAME);
        let [one, other] = [&mut one, &mut other].map(|estimator| estimator.predicted(3 * SECOND).unwrap());
        let apart = flight.frame.position(&one.position) - flight.frame.position(&other.position);
        assert!(apart.norm() < 0.01, "{strategy:?}: {apart}");
        assert!(one.world_from_body.angle_to(&other.world_from_body) < 1e-3, "{strategy:?}");
        let ratio = one.covariance.norm() / other.covariance.norm();
        assert!((ratio - 1.0).abs() < 0.01, "{strategy:?}: {ratio}");
    }
}

/// The window relates any two of its keyframes, and the filter those that it holds.
#[test]
fn relative_poses_of_any_two_keyframes() {
    let flight = Flight::new(3, 1);
    for strategy in StrategyKind::ALL {
        let mut estimator = flown(&flight, *strategy);
        let before = estimator.predicted(3 * SECOND).unwrap();
        let is_smoother = estimator.is_smoothing();
        for to in [29, 30] {
            for span in [2, 5, 9] {
                let (from_ns, to_ns) = ((to - span) * FRAME, to * FRAME);
                for (provider, added) in [
                    ("camera", estimator.add_vio(Flight::relative(from_ns, to_ns))),
                    ("provider", estimator.add_given_factor(relative(from_ns, to_ns))),
                ] {
                    if is_smoother {
                        let is_taken = matches!(added, Ok(Added::Taken { nis: Some(nis) }) if nis < 5.0);
                        assert!(is_taken, "{provider}: {added:?}");
                    } else {
                        let text = format!("degraded: there is no keyframe at {from_ns} ns, or none any more");
                        assert_eq!(added.unwrap_err().to_string(), text, "{provider}");
                    }
                }
            }
        }
        let again = estimator.add_given_factor(relative(21 * FRAME, 30 * FRAME));
        assert_eq!(again, degraded(Reason::Duplicate));
        let output = estimator.predicted(3 * SECOND).unwrap();
        let [sigma, from] = [output, before].map(|output| output.covariance.trace());
        assert_eq!(sigma < from, is_smoother, "{strategy:?}: {sigma}, {from}");
        // The camera's last two frames are known to the filter as well.
        let mut estimator = started(&flight, *strategy);
        for sent in flight.sent(true, false, false) {
            sent.to(&mut estimator).unwrap();
            if let Sent::Vio(vio) = sent
                && vio.to_ns >= SECOND
            {
                // The sample at its end comes first.
                let added = estimator.add_given_factor(relative(vio.from_ns, vio.to_ns));
                assert!(added.is_ok(), "{strategy:?}: {added:?}");
            }
        }
        assert_eq!(count(estimator.sink(), "degraded"), 0, "{strategy:?}");
        assert!(flight.error(&estimator.predicted(3 * SECOND).unwrap()).0 < 2.0);
    }
}

/// Whatever the order in which they arrive, the bits are the same.
#[test]
fn factors_may_come_late() {
    let flight = Flight::new(3, 2);
    let given = |i: i64| match i % 3 {
        0 => linear(&flight, i * FRAME + STEP),
        1 => relative((i - 4) * FRAME, i * FRAME),
        _ => relative((i - 2) * FRAME, i * FRAME),
    };
    for strategy in StrategyKind::ALL {
        let [mut in_order, mut late] = [0, 7 * FRAME].map(|late_ns| {
            let mut estimator = started(&flight, *strategy);
            let mut next = 6;
            for sent in &flight.sent(true, true, false) {
                sent.to(&mut estimator).unwrap();
                while next < 29 && given(next).time_ns + late_ns <= sent.time_ns() - STEP {
                    ignore(estimator.add_given_factor(given(next)));
                    next += 1;
                }
            }
            (next..29).for_each(|i| ignore(estimator.add_given_factor(given(i))));
            estimator
        });
        assert!(late.counts().late > 10, "{:?}", late.counts());
        assert_eq!(answers(&mut in_order), answers(&mut late), "{strategy:?}");
    }
}

#[test]
fn what_is_wrong_is_refused_by_name() {
    let flight = Flight::new(3, 1);
    let at = 29 * FRAME;
    let of_linear = |change: &dyn Fn(&mut LinearFactor)| {
        let mut factor = linear(&flight, at);
        if let FactorForm::Linear(linear) = &mut factor.form {
            change(linear);
        }
        factor
    };
    let of_relative = |change: &dyn Fn(&mut RelativeFactor)| {
        let mut factor = relative(25 * FRAME, at);
        if let FactorForm::Relative(relative) = &mut factor.form {
            change(relative);
        }
        factor
    };
    let unknown = |from_ns: i64| Refusal::NoKeyframe { id: (from_ns as u64) ^ (1 << 63) };
    let cases = [
        (of_linear(&|linear| linear.residual[0] = f64::NAN), Refusal::NonFinite),
        (of_linear(&|linear| linear.jacobian[(4, 4)] = f64::INFINITY), Refusal::NonFinite),
        (of_linear(&|linear| linear.position.latitude = f64::NAN), Refusal::NonFinite),
        (of_linear(&|linear| linear.position.latitude = 2.0), Refusal::OutOfRange),
        (of_linear(&|linear| linear.jacobian *= 1e300), Refusal::OutOfRange),
        (of_linear(&|linear| linear.covariance[(0, 0)] = 0.0), Refusal::Noise),
        (of_linear(&|linear| linear.covariance[(3, 3)] = -1.0), Refusal::Noise),
        (of_linear(&|linear| linear.jacobian.fill(0.0)), Refusal::NotObservable),
        (of_relative(&|relative| relative.translation.x = f64::NAN), Refusal::NonFinite),
        (of_relative(&|relative| relative.covariance.fill(0.0)), Refusal::Noise),
        (of_relative(&|relative| relative.from_ns = 25 * FRAME + STEP), unknown(25 * FRAME + STEP)),
        (of_relative(&|relative| relative.from_ns = -SECOND), unknown(-SECOND)),
        (
            of_relative(&|relative| relative.from_ns = 30 * FRAME),
            Refusal::TimeNotIncreasing { previous_ns: 30 * FRAME, time_ns: at },
        ),
    ];
    for strategy in StrategyKind::ALL {
        let mut estimator = flown(&flight, *strategy);
        let before = answers(&mut estimator);
        for (factor, refusal) in &cases {
            assert_eq!(estimator.add_given_factor(*factor), degraded(*refusal), "{strategy:?} {factor:?}");
        }
        assert_eq!(count(estimator.sink(), "degraded"), cases.len());
        assert_eq!(before, answers(&mut estimator), "{strategy:?}: what is refused changes nothing");
        // One that does not fit meets the gate.
        let wrong = of_linear(&|linear| linear.residual[0] += 50.0);
        let wrong = estimator.add_given_factor(GivenFactor { provider: 7, ..wrong });
        assert!(is_gated(&wrong), "{wrong:?}");
    }
}
