//! Single cases of the smoother.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::flight::{DT_NS, Drone, Flight, N, Smoother, converged, linear, open, sample, sensors};
use crate::navigation::eskf::tests::bad_samples_are_refused;
use crate::navigation::{
    AbsolutePose, EskfFilter, Estimate, FixedLagSmoother, GaussMarkov, GnssPosition, ImuMean, Kernel, NAVIGATION,
    Navigation, NavigationFactor, Refusal, RelativePose, SmootherParams, Start, Stream,
};

type Plain = FixedLagSmoother;

fn level() -> UnitQuaternion<f64> {
    UnitQuaternion::identity()
}

fn rest(time_ns: i64) -> ImuMean {
    let gravity = Vector3::new(0.0, 0.0, 9.80665);
    ImuMean { time_ns, angular_velocity: Vector3::zeros(), specific_force: gravity }
}

/// A smoother at rest, level, at the origin to within `deviation`, with `keyframes` of 0.1 s.
fn at_rest(params: SmootherParams, deviation: f64, keyframes: u64) -> Plain {
    let mut smoother = Plain::new(params).unwrap();
    let start = Start::at(0, (Vector3::zeros(), deviation), (Vector3::zeros(), 0.1), (level(), 0.05));
    smoother.start(0, &start).unwrap();
    for k in 1..keyframes {
        wait(&mut smoother, k);
    }
    smoother
}

fn wait(smoother: &mut Plain, k: u64) {
    for i in 1..=10 {
        smoother.propagate(&rest(((k as i64 - 1) * 10 + i) * DT_NS)).unwrap();
    }
    smoother.add_keyframe(k).unwrap();
}

#[test]
fn refusals_are_named_and_counted() {
    let mut smoother = Plain::new(SmootherParams { window: 3, factors: 2, ..SmootherParams::default() }).unwrap();
    let mut stream = Stream::default();
    let fix = GnssPosition::new(Vector3::zeros(), 1.0, 1.0);
    assert_eq!(smoother.add(&mut stream, 0, fix), Err(Refusal::NotStarted));
    assert_eq!(smoother.propagate(&rest(1)), Err(Refusal::NotStarted));
    assert_eq!(smoother.add_keyframe(1), Err(Refusal::NotStarted));
    assert_eq!(smoother.update(), Err(Refusal::NotStarted));
    smoother = at_rest(SmootherParams { window: 3, factors: 2, ..SmootherParams::default() }, 1.0, 5);
    assert_eq!(smoother.keyframes().collect::<Vec<_>>(), [2, 3, 4]);
    let time_ns = 400_000_000;
    let refused = Refusal::TimeNotIncreasing { previous_ns: time_ns, time_ns };
    assert_eq!(smoother.add_keyframe(5), Err(refused), "no sample since the last");
    bad_samples_are_refused(time_ns, |sample| smoother.propagate(sample));
    smoother.propagate(&rest(time_ns + DT_NS)).unwrap();
    assert!(matches!(smoother.add_keyframe(4), Err(Refusal::TimeNotIncreasing { .. })), "an id twice");
    // Keyframe 1 has left the window, keyframe 2 has no previous keyframe, and keyframe 4 is no earlier one.
    let relative = |id| RelativePose::new(id, (Vector3::zeros(), 0.1), (level(), 0.1));
    let at = |x: f64| GnssPosition::new(Vector3::new(x, 0.0, 0.0), 1.0, 1.0);
    let refused: [(u64, NavigationFactor, Refusal); 6] = [
        (1, fix.into(), Refusal::NoKeyframe { id: 1 }),
        (2, relative(1).into(), Refusal::NoKeyframe { id: 1 }),
        (3, relative(4).into(), Refusal::NoKeyframe { id: 4 }),
        (4, at(f64::NAN).into(), Refusal::NonFinite),
        (4, GnssPosition { covariance: -Matrix3::identity(), ..fix }.into(), Refusal::Noise),
        (4, at(1e20).into(), Refusal::OutOfRange),
    ];
    for (id, factor, refusal) in refused {
        assert_eq!(smoother.add(&mut stream, id, factor), Err(refusal), "{factor:?}");
    }
    assert!(matches!(smoother.add(&mut stream, 4, at(100.0)), Err(Refusal::Gate { .. })));
    smoother.add(&mut stream, 4, fix).unwrap();
    smoother.add(&mut stream, 4, relative(3)).unwrap();
    assert_eq!(smoother.add(&mut stream, 4, fix), Err(Refusal::Full { id: 4 }));
    let counts = stream.counts();
    assert_eq!((counts.fused, counts.not_applicable, counts.invalid, counts.gate), (2, 5, 3, 1));
}

#[test]
fn a_parameter_out_of_range_is_named() {
    let refused = Plain::new(SmootherParams { window: 1, ..SmootherParams::default() });
    assert!(refused.is_err_and(|error| error.to_string().contains("window")));
}

/// The newest covariance is that of the filter on a flight that matches the filter's model.
#[test]
fn the_newest_covariance_is_that_of_the_filter() {
    let mut flight = Flight::new(5, 60, 0.0);
    for measured in &mut flight.measured {
        measured.retain(|factor| !matches!(factor, NavigationFactor::RelativePose(_)));
    }
    let smoother = flight.flown(linear(7));
    let mut filter = EskfFilter::<Drone, N>::new(sensors()).unwrap();
    filter.start(&flight.start).unwrap();
    for k in 1..60 {
        for sample in &flight.samples[k] {
            filter.propagate(sample).unwrap();
        }
        for factor in &flight.measured[k] {
            match factor {
                NavigationFactor::GnssPosition(fix) => filter.update(&mut open(), fix).map(drop),
                NavigationFactor::GnssVelocity(fix) => filter.update(&mut open(), fix).map(drop),
                NavigationFactor::AbsolutePose(pose) => filter.update(&mut open(), pose).map(drop),
                _ => Ok(()),
            }
            .unwrap();
        }
    }
    let (here, there) = (smoother.covariance().unwrap(), filter.covariance());
    for i in 0..N {
        for j in 0..N {
            let scale = (there[(i, i)] * there[(j, j)]).sqrt();
            let apart = (here[(i, j)] - there[(i, j)]).abs();
            assert!(apart < 1e-4 * scale, "{i} {j}: {} {}", here[(i, j)], there[(i, j)]);
        }
    }
    let error = smoother.estimate().unwrap().error_to::<Drone>(filter.estimate().unwrap());
    assert!(error.amax() < 1e-5, "{error}");
}

/// A tiny pivot is no trouble: with a millisecond between keyframes and a position known to a thousand kilometres, it
/// is tiny relative to its diagonal. It is still correct.
#[test]
fn a_tiny_pivot_is_no_trouble() {
    let mut smoother = at_rest(SmootherParams { window: 10, ..SmootherParams::default() }, 1e6, 1);
    for k in 1..200 {
        smoother.propagate(&rest(k * 1_000_000)).unwrap();
        smoother.add_keyframe(k as u64).unwrap();
        smoother.update().unwrap();
    }
    let deviation = smoother.covariance().unwrap()[(0, 0)].sqrt();
    assert!((deviation / 1e6 - 1.0).abs() < 1e-6, "{deviation}");
    let fix = GnssPosition::new(Vector3::new(4e5, 0.0, 0.0), 1.0, 1.0);
    smoother.add(&mut Stream::default(), 195, fix).unwrap();
    smoother.update().unwrap();
    let variance = smoother.covariance().unwrap()[(0, 0)];
    assert!((smoother.estimate().unwrap().position.x - 4e5).abs() < 0.1 && (0.9..1.1).contains(&variance));
}

#[test]
fn a_gap_grows_the_covariance_and_is_counted() {
    let mut smoother = at_rest(SmootherParams::default(), 1.0, 3);
    smoother.update().unwrap();
    let before = smoother.pose_covariance().unwrap();
    smoother.propagate(&rest(3_200_000_000)).unwrap();
    smoother.add_keyframe(3).unwrap();
    smoother.update().unwrap();
    assert_eq!(smoother.gaps(), 1);
    let (after, estimate) = (smoother.pose_covariance().unwrap(), smoother.estimate().unwrap());
    assert!(after[(0, 0)] > 4.0 * before[(0, 0)] && after[(5, 5)] > 1.0, "{after}");
    // At rest before the gap, so also after it.
    assert!(estimate.position.norm() < 0.1, "{}", estimate.position);
}

/// The final position after a second at rest at the origin, where one of many poses is 40 m off.
fn with_an_outlier(kernel: Kernel, at: u64) -> f64 {
    let mut smoother = at_rest(SmootherParams::default(), 30.0, 1);
    for k in 1..12 {
        wait(&mut smoother, k);
        let x = if k == at { 40.0 } else { 0.0 };
        let pose = AbsolutePose::new((Vector3::new(x, 0.0, 0.0), 1.0), (level(), 0.05));
        smoother.add_robust(&mut open(), k, pose, kernel).unwrap();
        for _ in 0..5 {
            smoother.update().unwrap();
        }
    }
    smoother.estimate().unwrap().position.x
}

#[test]
fn a_robust_kernel_takes_an_outlier_for_one() {
    let plain = with_an_outlier(Kernel::Squares, 6);
    assert!(plain > 2.0, "{plain}");
    for (kernel, part) in
        [(Kernel::Huber(1.345), 0.1), (Kernel::Cauchy(2.385), 0.02), (Kernel::GemanMcClure(3.0), 1e-3)]
    {
        let robust = with_an_outlier(kernel, 6);
        assert!(robust < part * plain, "{kernel:?}: {robust}, without {plain}");
    }
    // A measurement that fitted when it arrived is exposed by later ones: the cost is convex.
    let learnt = with_an_outlier(Kernel::Huber(1.345), 1);
    assert!(learnt < 0.1 * plain, "{learnt}");
}

#[test]
fn between_keyframes_it_goes_on_with_the_imu() {
    let flight = Flight::new(4, 20, 0.0);
    let mut smoother = flight.flown(linear(10));
    for i in 191..=195 {
        smoother.propagate(&sample(i)).unwrap();
    }
    let predicted = smoother.predicted().unwrap();
    assert_eq!(predicted.time_ns, 195 * DT_NS);
    for i in 196..=200 {
        smoother.propagate(&sample(i)).unwrap();
    }
    let end = smoother.predicted().unwrap();
    smoother.add_keyframe(20).unwrap();
    let keyframe = smoother.estimate().unwrap();
    assert!((end.position - keyframe.position).norm() < 1e-9 && (end.velocity - keyframe.velocity).norm() < 1e-9);
    let mean = (predicted.velocity + end.velocity) * 0.5;
    assert!(((end.position - predicted.position) / 0.05 - mean).norm() < 0.1);
}

/// A scale with a deviation of zero is known, and no reason to refuse a filter that does not have it.
#[test]
fn a_warm_start_may_lack_a_state_that_is_known() {
    let mut plain = Plain::new(SmootherParams::default()).unwrap();
    let first = Flight::new(7, 40, 1.0).flown(linear(10));
    plain.adopt::<Drone, N>(39, &first.estimate().unwrap(), &first.covariance().unwrap()).unwrap();
    let mut params = linear(10);
    params.sensors.relative_scale = GaussMarkov::new(0.0, 20.0);
    let mut known = Smoother::new(params).unwrap();
    let (estimate, covariance) = (plain.estimate().unwrap(), plain.covariance().unwrap());
    assert_eq!(known.adopt::<Navigation, NAVIGATION>(39, &estimate, &covariance), Ok(()));
}

/// A warm start has what the filter has: a filter with other optional states, with all correlations.
#[test]
fn a_warm_start_has_what_the_filter_has() {
    let flight = Flight::new(7, 40, 1.0);
    let first = flight.flown(linear(10));
    let (estimate, covariance) = (first.estimate().unwrap(), first.covariance().unwrap());
    let mut same = Smoother::new(linear(10)).unwrap();
    same.adopt::<Drone, N>(39, &estimate, &covariance).unwrap();
    assert!((same.covariance().unwrap() - covariance).amax() < 1e-8);
    assert_eq!(same.estimate().unwrap().error_to::<Drone>(&estimate).amax(), 0.0);
    let mut plain = Plain::new(SmootherParams::default()).unwrap();
    plain.adopt::<Drone, N>(39, &estimate, &covariance).unwrap();
    let of_navigation = covariance.fixed_view::<NAVIGATION, NAVIGATION>(0, 0).into_owned();
    assert!((plain.covariance().unwrap() - of_navigation).amax() < 1e-8);
    plain.propagate(&sample(391)).unwrap();
    plain.add_keyframe(40).unwrap();
    let (mut broken, mut skewed) = (covariance, covariance);
    broken[(3, 4)] = f64::NAN;
    // Positive definite only if half of it is read.
    skewed[(0, 1)] += 3.0 * covariance[(0, 0)];
    for (bad, refusal) in [
        (-covariance, Refusal::Noise),
        (broken, Refusal::NonFinite),
        (skewed, Refusal::Noise),
        (covariance * 1e-300, Refusal::Noise),
    ] {
        assert_eq!(plain.adopt::<Drone, N>(41, &estimate, &bad), Err(refusal), "{bad}");
    }
    let nowhere = UnitQuaternion::new_unchecked(nalgebra::Quaternion::default());
    for (absurd, refusal) in [
        (Estimate { position: Vector3::x() * f64::NAN, ..estimate }, Refusal::NonFinite),
        (Estimate { position: Vector3::x() * 1e12, ..estimate }, Refusal::OutOfRange),
        (Estimate { gyroscope_bias: Vector3::x() * 1e9, ..estimate }, Refusal::OutOfRange),
        (Estimate { angular_velocity: Vector3::x() * f64::INFINITY, ..estimate }, Refusal::NonFinite),
        (Estimate { specific_force: Vector3::x() * 1e200, ..estimate }, Refusal::OutOfRange),
        (Estimate { world_from_body: nowhere, ..estimate }, Refusal::NonFinite),
    ] {
        assert_eq!(plain.adopt::<Drone, N>(41, &absurd, &covariance), Err(refusal), "{absurd:?}");
    }
    assert_eq!(plain.keyframes().collect::<Vec<_>>(), [39, 40], "it is as it was");
    // Any time is a time.
    for time_ns in [i64::MIN, -1, i64::MAX] {
        plain.adopt::<Drone, N>(41, &Estimate { time_ns, ..estimate }, &covariance).unwrap();
        let gone = plain.propagate(&sample(392));
        assert_eq!(gone.is_ok(), time_ns == -1, "{gone:?}");
        assert!(plain.predicted().unwrap().is_finite());
    }
}

/// Between keyframes that are not neighbours, only poses can be compared: `Drone` also has the scale of relative poses.
#[test]
fn relative_poses_of_any_two_keyframes() {
    let flight = Flight::new(3, 12, 1.0);
    let mut smoother = flight.flown(linear(6));
    let mut stream = Stream::default();
    let pose = flight.relative_pose(7, 11, &Vector3::zeros(), &Vector3::zeros());
    let refused = smoother.add(&mut stream, 11, pose);
    assert_eq!(refused, Err(Refusal::NotAdjacent { id: 7 }));
    let error = refused.unwrap_err().to_string();
    assert_eq!(error, "keyframe 7 is not the one directly before, and more than the poses is compared");
    let gone = RelativePose { keyframe: 5, ..pose };
    assert_eq!(smoother.add(&mut stream, 11, NavigationFactor::Between(gone)), Err(Refusal::NoKeyframe { id: 5 }));
    let wrong = RelativePose { translation: pose.translation + Vector3::x(), ..pose };
    let wrong = smoother.add(&mut stream, 11, NavigationFactor::Between(wrong));
    assert!(matches!(wrong, Err(Refusal::Gate { .. })), "{wrong:?}");
    let before = smoother.covariance().unwrap();
    let fused = smoother.add(&mut stream, 11, NavigationFactor::Between(pose)).unwrap();
    assert!(fused.dimension == 6 && fused.nis < 20.0, "{fused:?}");
    smoother.update().unwrap();
    // Two keyframes that are known relative to each other are not known better in the world.
    let after = smoother.covariance().unwrap();
    assert!(after[(0, 0)] <= before[(0, 0)] && after[(0, 0)] > 0.9 * before[(0, 0)], "{before} {after}");
    assert!(after[(6, 6)] < before[(6, 6)], "{before} {after}");
}

/// A robust kernel has its weight from the estimate of the window, as between neighbours.
#[test]
fn an_outlier_between_any_two_keyframes() {
    let flight = Flight::new(4, 30, 1.0);
    let flown = |kernel: Option<Kernel>| {
        let mut smoother = flight.flown(converged(12));
        let pose = flight.relative_pose(20, 29, &(Vector3::x() * 3.0), &Vector3::zeros());
        if let Some(kernel) = kernel {
            smoother.add_robust(&mut open(), 29, NavigationFactor::Between(pose), kernel).unwrap();
        }
        smoother.update().unwrap();
        flight.error(29, &smoother.estimate().unwrap()).fixed_rows::<3>(0).norm()
    };
    let errors = [flown(None), flown(Some(Kernel::Cauchy(1.0))), flown(Some(Kernel::Squares))];
    assert!((errors[1] - errors[0]).abs() < 0.05 && errors[2] > errors[0] + 0.4, "{errors:?}");
}
