//! Tests of a filter that continues from another estimator's estimate.

use nalgebra::{UnitQuaternion, Vector3};

use super::super::*;
use super::laws::flight_plain;
use crate::navigation::Refusal;
use crate::navigation::measurement::RelativePose;
use crate::navigation::state::{NAVIGATION, Navigation, Optional, States, offset};
use crate::navigation::stream::Stream;

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

/// A filter of one kind that goes on from one of another.
fn adopted<S: States, const N: usize, T: States, const M: usize>(from: &EskfFilter<T, M>) -> EskfFilter<S, N> {
    let mut to = EskfFilter::new(EskfParams::default()).unwrap();
    to.adopt::<T, M>(from.estimate().unwrap(), from.covariance()).unwrap();
    to
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
    let from = flight_plain::<More, MORE>();
    let to: EskfFilter<Fewer, FEWER> = adopted(&from);
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
    let bare: EskfFilter<Navigation, NAVIGATION> = adopted(&flight_plain::<More, MORE>());
    let mut to: EskfFilter<More, MORE> = adopted(&bare);
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
fn what_is_no_estimate_is_refused_and_changes_nothing() {
    let from = flight_plain::<More, MORE>();
    let (estimate, covariance) = (*from.estimate().unwrap(), *from.covariance());
    let mut to: EskfFilter<Fewer, FEWER> = adopted(&from);
    let before = to;
    let (mut broken, mut infinite) = (estimate, covariance);
    broken.velocity.y = f64::NAN;
    infinite[(2, 2)] = f64::INFINITY;
    for (estimate, covariance, refusal) in [
        (broken, covariance, Refusal::NonFinite),
        (estimate, infinite, Refusal::NonFinite),
        (estimate, -covariance, Refusal::Noise),
    ] {
        assert_eq!(to.adopt::<More, MORE>(&estimate, &covariance), Err(refusal), "{estimate:?} {covariance}");
        assert_eq!(to, before);
    }
}
