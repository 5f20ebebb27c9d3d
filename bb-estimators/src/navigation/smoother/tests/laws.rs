//! Invariants of every flight.

use bb_tests::laws;
use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::flight::{Flight, agree, apart, converged, differ, linear, open, usual};
use crate::navigation::{AbsolutePose, GnssPosition, GnssVelocity, NavigationFactor, RelativePose, SmootherParams};

laws! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    /// Information that leaves the window is not lost: with linear factors, the result matches the one with all keyframes. Also with
    /// relative poses between keyframes that are not neighbours.
    #[test]
    fn a_window_is_the_batch(seed in any::<u64>(), window in 2_usize..12, related in any::<bool>()) {
        let flight = Flight::new(seed, 40, 1.0).related(seed, if related { window - 1 } else { 0 });
        let here = flight.flown(linear(window));
        prop_assert_eq!((here.marginalised(), here.keyframes().count()), (40 - window as u64, window));
        agree(&here, &flight.flown(linear(40)), (1e-9, 1e-9), differ)?;
    }

    /// Late measurements, in any order, give the same estimate in the end.
    #[test]
    fn the_order_of_arrival_does_not_matter(
        seed in any::<u64>(),
        order in Just((1..12_usize).collect::<Vec<_>>()).prop_shuffle(),
        related in 0_usize..11,
    ) {
        let flight = Flight::new(seed, 12, 1.0).related(seed, related);
        let arrived = |order: &[usize]| {
            let mut smoother = flight.begun(converged(12));
            for k in 1..12 {
                flight.fly_to(&mut smoother, k);
            }
            for k in order {
                for factor in flight.measured[*k].iter().rev() {
                    smoother.add(&mut open(), *k as u64, *factor).unwrap();
                }
                smoother.update().unwrap();
            }
            smoother
        };
        let in_order = arrived(&(1..12).collect::<Vec<_>>());
        agree(&in_order, &arrived(&order), (1e-8, 1e-7), differ)?;
        // With an update at each keyframe, the samples are integrated with better-known biases.
        agree(&in_order, &flight.flown(converged(12)), (1e-3, f64::INFINITY), differ)?;
    }

    /// The order of the measurements of one keyframe does not matter either, without an update in between.
    #[test]
    fn nor_does_that_at_one_keyframe(seed in any::<u64>()) {
        let mut flight = Flight::new(seed, 36, 1.0);
        let one = flight.flown(linear(5));
        flight.measured.iter_mut().for_each(|measured| measured.reverse());
        let other = flight.flown(linear(5));
        let apart = apart(&one.estimate().unwrap(), &other.estimate().unwrap());
        prop_assert!(apart < 1e-9, "{apart}");
        prop_assert!(differ(&one.covariance().unwrap(), &other.covariance().unwrap()) < 1e-9);
    }

    /// The estimate does not depend on the origin of the world or its heading.
    #[test]
    fn heading_and_origin(seed in any::<u64>(), heading in -3.1..3.1, x in -1e4..1e4, y in -1e4..1e4) {
        let flight = Flight::new(seed, 30, 1.0).related(seed, 9);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading);
        let origin = Vector3::new(x, y, -0.5 * x);
        let place = |position: &Vector3<f64>| turn * position + origin;
        let other = Flight::new(seed, 30, 1.0).related(seed, 9).elsewhere(&turn, &origin);
        // To convergence: relinearisation must not depend on the last bit of how far a keyframe moved.
        let params = converged(10);
        let (here, there) = (flight.flown(params).estimate().unwrap(), other.flown(params).estimate().unwrap());
        prop_assert!((place(&here.position) - there.position).norm() < 1e-6);
        prop_assert!((turn * here.velocity - there.velocity).norm() < 1e-6);
        prop_assert!((turn * here.world_from_body).angle_to(&there.world_from_body) < 1e-6);
        prop_assert!((here.gyroscope_bias - there.gyroscope_bias).norm() < 1e-7);
    }

    /// Unobservable states stay unknown, however often they are relinearised: without a compass or a position, heading
    /// and position are never better known than at the start.
    #[test]
    fn what_is_unobservable_stays_unknown(seed in any::<u64>()) {
        let mut flight = Flight::new(seed, 80, 1.0).related(seed, 5);
        for measured in &mut flight.measured {
            measured.retain(|factor| matches!(factor, NavigationFactor::RelativePose(_) | NavigationFactor::Between(_)));
        }
        // A velocity that is known in the world is as good as a heading.
        flight.start.velocity_covariance *= 1e6;
        let params = SmootherParams { relinearise_rotation: 1e-3, ..linear(6) };
        let mut smoother = flight.begun(SmootherParams { iterations: 3, ..params });
        let mut least = f64::INFINITY;
        for k in 1..80 {
            flight.advance(&mut smoother, k);
            smoother.update().unwrap();
            let covariance = smoother.covariance().unwrap();
            least = least.min(covariance[(8, 8)]);
            prop_assert!(covariance[(0, 0)] + covariance[(1, 1)] >= 2.0 * (1.0 - 1e-9));
        }
        prop_assert!(least >= 0.05 * 0.05 * (1.0 - 1e-9), "{least}");
    }

    /// Arbitrary numbers leave it unchanged or with finite numbers.
    #[test]
    fn absurd_measurements(
        seed in any::<u64>(),
        numbers in proptest::collection::vec(prop_oneof![
            any::<f64>(), Just(f64::NAN), Just(f64::INFINITY), Just(1e300), Just(-1e-300), -10.0..10.0
        ], 7),
    ) {
        let flight = Flight::new(seed, 12, 1.0);
        let mut smoother = flight.flown(linear(6));
        let vector = Vector3::new(numbers[0], numbers[1], numbers[2]);
        let [x, y, z, w] = [numbers[3], numbers[4], numbers[5], numbers[6]];
        let turn = UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(w, x, y, z));
        let mut stream = open();
        let before = smoother.estimate().unwrap();
        let mut refused = 0;
        let factors: [NavigationFactor; 4] = [
            GnssPosition::new(vector, x, y).into(),
            GnssVelocity::new(vector, z, w).into(),
            AbsolutePose::new((vector, x), (turn, y)).into(),
            RelativePose::new(10, (vector, z), (turn, w)).into(),
        ];
        for factor in factors {
            refused += u64::from(smoother.add(&mut stream, 11, factor).is_err());
        }
        let counts = stream.counts();
        prop_assert_eq!(counts.invalid + counts.not_applicable + counts.gate, refused);
        match smoother.update() {
            Ok(_) => prop_assert!(smoother.estimate().unwrap().is_finite()),
            Err(error) => prop_assert!(false, "{}", error),
        }
        if refused == 4 {
            prop_assert!(apart(&before, &smoother.estimate().unwrap()) < 1e-9);
        }
    }
}

/// A new keyframe costs only the elimination of what it changes, regardless of the size of the window.
#[test]
fn only_the_end_is_eliminated_again() {
    for window in [5, 10, 100] {
        let flight = Flight::new(3, 160, 1.0);
        let mut smoother = flight.begun(usual(window));
        let mut costs = Vec::new();
        for k in 1..160 {
            flight.advance(&mut smoother, k);
            costs.push(smoother.update().unwrap().eliminated);
        }
        costs.drain(..40);
        costs.sort_unstable();
        assert!(costs[costs.len() / 2] <= 1, "{window}: {costs:?}");
    }
}

/// An update that reaches its limit of iterations says so, and the next ones continue, though nothing is added.
#[test]
fn an_update_continues_what_the_last_did_not_reach() {
    let flight = Flight::new(5, 12, 1.0);
    let solved = |iterations: usize| {
        let params =
            SmootherParams { relinearise_rotation: 1e-7, relinearise_position: 1e-6, iterations, ..linear(12) };
        let mut smoother = flight.begun(params);
        (1..12).for_each(|k| flight.advance(&mut smoother, k));
        smoother
    };
    let (mut at_once, mut hasty) = (solved(20), solved(1));
    assert!(at_once.update().unwrap().is_converged);
    let updates: Vec<bool> = (0..6).map(|_| hasty.update().unwrap().is_converged).collect();
    assert_eq!((updates[0], updates[5]), (false, true), "{updates:?}");
    agree(&hasty, &at_once, (1e-6, f64::INFINITY), differ).unwrap();
    let mut fixed = solved(0);
    for _ in 0..3 {
        let updated = fixed.update().unwrap();
        assert_eq!((updated.relinearised, updated.is_converged), (0, false), "it never gets there");
    }
}
