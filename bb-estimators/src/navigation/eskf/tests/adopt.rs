//! Tests of a filter that continues from another estimator's estimate.

use super::super::*;
use crate::navigation::Refusal;
use crate::navigation::measurement::{GnssPosition, RelativePose};
use crate::navigation::noise::Noise;
use crate::navigation::state::{NAVIGATION, Navigation, Optional, States, offset};
use crate::navigation::stream::Stream;
use nalgebra::{SMatrix, UnitQuaternion, Vector3};

/// Optional states in a different order than [`Fewer`], and states that it lacks.
#[derive(Clone, Copy, Debug, PartialEq)]
struct More;

impl States for More {
    const OPTIONAL: &'static [Optional] = &[Optional::Keyframe, Optional::RelativeScale, Optional::GnssLeverArm];
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Fewer;

impl States for Fewer {
    const OPTIONAL: &'static [Optional] = &[Optional::GnssLeverArm, Optional::RelativeScale];
}

const MORE: usize = More::DIMENSION;
const FEWER: usize = Fewer::DIMENSION;

/// A filter that has flown for five seconds, so that all errors are correlated.
fn flown() -> EskfFilter<More, MORE> {
    let mut filter = EskfFilter::<More, MORE>::new(EskfParams::default()).unwrap();
    let mut noise = Noise::new(5);
    let (origin, speed) = (Vector3::zeros(), Vector3::new(3.0, 1.0, 0.0));
    filter.start(&Start::at(0, (origin, 2.0), (speed, 0.5), (UnitQuaternion::identity(), 0.05))).unwrap();
    filter.set_keyframe(0);
    let (mut gnss, mut odometry) = (Stream::default(), Stream::default());
    for i in 1..=500 {
        let specific_force = Vector3::new(0.0, 0.0, 9.80665) + noise.vector(0.02);
        let angular_velocity = Vector3::new(0.0, 0.0, 0.1) + noise.vector(1e-3);
        filter.propagate(&ImuMean { time_ns: i * 10_000_000, angular_velocity, specific_force }).unwrap();
        if i % 20 == 0 {
            let at = filter.estimate().unwrap();
            let fix = GnssPosition::new(at.position + noise.vector(0.5), 1.0, 1.0);
            let keyframe = at.keyframe.unwrap();
            let way = keyframe.world_from_body.inverse() * (at.position - keyframe.position) + noise.vector(0.02);
            let turn = keyframe.world_from_body.inverse() * at.world_from_body;
            filter.update(&mut gnss, &fix).unwrap();
            filter.update(&mut odometry, &RelativePose::new(keyframe.id, (way, 0.05), (turn, 0.01))).unwrap();
            filter.set_keyframe(i as u64);
        }
    }
    filter
}

/// The index of one filter's error in another; `None` if the other lacks it.
fn place<S: States, T: States>(error: usize) -> Option<usize> {
    if error < NAVIGATION {
        return Some(error);
    }
    let of = |state: &&Optional| {
        let first = offset::<S>(**state).unwrap();
        (first..first + state.dimension()).contains(&error)
    };
    let state = S::OPTIONAL.iter().find(of).unwrap();
    Some(offset::<T>(*state)? + error - offset::<S>(*state).unwrap())
}

#[test]
fn all_that_both_estimate_is_taken_over_with_its_correlations() {
    let from = flown();
    let mut to = EskfFilter::<Fewer, FEWER>::new(EskfParams::default()).unwrap();
    to.adopt::<More, MORE>(from.estimate().unwrap(), from.covariance()).unwrap();
    let (theirs, ours) = (from.estimate().unwrap(), to.estimate().unwrap());
    assert_eq!((ours.time_ns, ours.position, ours.velocity), (theirs.time_ns, theirs.position, theirs.velocity));
    assert!(ours.world_from_body.angle_to(&theirs.world_from_body) < 1e-15);
    assert_eq!((ours.accelerometer_bias, ours.gyroscope_bias), (theirs.accelerometer_bias, theirs.gyroscope_bias));
    let mut correlated = 0;
    for i in 0..FEWER {
        let row = place::<Fewer, More>(i).unwrap();
        if i >= NAVIGATION {
            assert_eq!(ours.optional[i], theirs.optional[row], "{i}");
        }
        for j in 0..FEWER {
            let expected = from.covariance()[(row, place::<Fewer, More>(j).unwrap())];
            assert!((to.covariance()[(i, j)] - expected).abs() <= 1e-15 * expected.abs(), "{i}, {j}");
            correlated += usize::from(i != j && expected != 0.0);
        }
    }
    assert!(correlated > 200 && theirs.optional.iter().any(|x| *x != 0.0), "{correlated}");
    assert!(to.is_consistent() && to.dead_reckoning_s() == 0.0);
}

#[test]
fn what_the_other_has_not_is_zero_with_the_deviation_of_the_parameters() {
    let from = flown();
    let mut bare = EskfFilter::<Navigation>::new(EskfParams::default()).unwrap();
    bare.adopt::<More, MORE>(from.estimate().unwrap(), from.covariance()).unwrap();
    let mut to = EskfFilter::<More, MORE>::new(EskfParams::default()).unwrap();
    to.adopt::<Navigation, NAVIGATION>(bare.estimate().unwrap(), bare.covariance()).unwrap();
    assert!(to.is_consistent());
    assert_eq!(to.estimate().unwrap().keyframe, None);
    for state in [Optional::RelativeScale, Optional::GnssLeverArm] {
        let (first, process) = (offset::<More>(state).unwrap(), EskfParams::default().process(state).unwrap());
        for i in first..first + state.dimension() {
            assert_eq!(to.estimate().unwrap().optional[i], 0.0);
            assert_eq!(to.covariance()[(i, i)], process.deviation * process.deviation);
            assert!((0..MORE).all(|j| i == j || to.covariance()[(i, j)] == 0.0));
        }
    }
    // A relative pose needs a keyframe first.
    let pose = RelativePose::new(0, (Vector3::zeros(), 0.1), (UnitQuaternion::identity(), 0.1));
    assert_eq!(to.update(&mut Stream::default(), &pose), Err(Refusal::NoKeyframe { id: 0 }));
}

#[test]
fn both_go_on_alike() {
    let mut from = flown();
    let mut to = EskfFilter::<More, MORE>::new(EskfParams::default()).unwrap();
    to.adopt::<More, MORE>(from.estimate().unwrap(), from.covariance()).unwrap();
    let mut streams = [Stream::default(); 2];
    let mut noise = Noise::new(8);
    for i in 501..=700 {
        let specific_force = Vector3::new(0.0, 0.0, 9.80665) + noise.vector(0.02);
        let sample = ImuMean { time_ns: i * 10_000_000, angular_velocity: noise.vector(0.01), specific_force };
        from.propagate(&sample).unwrap();
        to.propagate(&sample).unwrap();
        if i % 50 == 0 {
            let fix = GnssPosition::new(from.estimate().unwrap().position + noise.vector(0.5), 1.0, 1.0);
            from.update(&mut streams[0], &fix).unwrap();
            to.update(&mut streams[1], &fix).unwrap();
        }
    }
    let apart = from.estimate().unwrap().position - to.estimate().unwrap().position;
    assert!(apart.norm() < 1e-9, "{apart}");
    let index = |i: usize| place::<Fewer, More>(i).unwrap();
    for i in 0..FEWER {
        let [one, other] = [&from, &to].map(|filter| filter.covariance()[(index(i), index(i))]);
        assert!((one - other).abs() < 1e-9 * one, "{i}: {one}, {other}");
    }
}

#[test]
fn what_is_no_estimate_is_refused_and_changes_nothing() {
    let from = flown();
    let (estimate, covariance) = (*from.estimate().unwrap(), *from.covariance());
    let mut to = EskfFilter::<Fewer, FEWER>::new(EskfParams::default()).unwrap();
    to.adopt::<More, MORE>(&estimate, &covariance).unwrap();
    let before = (*to.estimate().unwrap(), *to.covariance(), to.resets());
    let mut broken = estimate;
    broken.velocity.y = f64::NAN;
    assert_eq!(to.adopt::<More, MORE>(&broken, &covariance), Err(Refusal::NonFinite));
    let mut infinite = covariance;
    infinite[(2, 2)] = f64::INFINITY;
    assert_eq!(to.adopt::<More, MORE>(&estimate, &infinite), Err(Refusal::NonFinite));
    let indefinite: SMatrix<f64, MORE, MORE> = -covariance;
    assert_eq!(to.adopt::<More, MORE>(&estimate, &indefinite), Err(Refusal::Noise));
    assert_eq!((*to.estimate().unwrap(), *to.covariance(), to.resets()), before);
}
