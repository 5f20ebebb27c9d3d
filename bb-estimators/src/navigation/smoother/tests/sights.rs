//! Invariants of every flight with a camera.

use bb_tests::laws;
use nalgebra::{SVector, UnitQuaternion, Vector2, Vector3};
use proptest::prelude::*;

use super::super::keyframe::Keyframe;
use super::super::landmark::Sight;
use super::flight::{Drone, Flight, N, agree, converged, derivative, linear, open, usual, variances_differ};
use super::scenery::{Scenery, camera, exact, seeing};
use crate::navigation::{LandmarkParams, NavigationFactor, Observation, SmootherParams, Stream};

laws! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// The Jacobians by pose and landmark match the numeric ones.
    #[test]
    fn derivatives_are_the_numeric_ones(
        seed in any::<u64>(), u in 20.0..730.0_f64, v in 20.0..460.0_f64, depth in 5.0..80.0_f64,
    ) {
        let flight = Flight::new(seed, 2, 1.0);
        let smoother = flight.begun(linear(5));
        let keyframe = &smoother.window[0];
        let camera = camera();
        let (camera_from_world, centre) = camera.placed(&keyframe.point.position, &keyframe.point.world_from_body);
        let undistorted = camera.undistorted(&Vector2::new(u, v)).unwrap();
        let point = centre + camera_from_world.transpose() * undistorted.direction.push(1.0) * depth;
        let mut sight = Sight {
            serial: 0, version: 0, seen: undistorted, precision: 1.0, weight: 1.0,
            jacobian: nalgebra::Matrix2x3::zeros(), residual: Vector2::zeros(), arm: Vector3::zeros(),
        };
        prop_assert!(sight.linearise(&camera, keyframe, &point));
        prop_assert!(sight.residual.norm() < 1e-9);
        let residual = |keyframe: &Keyframe<NavigationFactor, N>, point: &Vector3<f64>| {
            sight.estimated::<_, Drone, N>(&camera, keyframe, point).unwrap().1
        };
        // The residual falls by the part that an error explains.
        let by_pose = derivative::<2, N>(1e-5, |error| {
            let mut keyframe = keyframe.clone();
            keyframe.correction = (*error).into();
            -residual(&keyframe, &point)
        });
        for (error, numeric) in by_pose.column_iter().enumerate() {
            let expected = sight.jacobian * sight.moved(&SVector::<f64, N>::ith(error, 1.0).into());
            prop_assert!((numeric - expected).norm() < 1e-5 * (1.0 + expected.norm()), "{error}: {numeric} {expected}");
        }
        let by_point = derivative::<2, 3>(1e-5, |moved| -residual(keyframe, &(point + moved)));
        for (numeric, exact) in by_point.column_iter().zip(sight.jacobian.column_iter()) {
            prop_assert!((numeric - exact).norm() < 1e-5 * (1.0 + numeric.norm()));
        }
    }

    /// Late observations, in any order, give the same estimate in the end.
    #[test]
    fn the_order_of_arrival_does_not_matter(
        seed in any::<u64>(),
        order in Just((0..10_usize).collect::<Vec<_>>()).prop_shuffle(),
    ) {
        let flight = Flight::new(seed, 10, 1.0);
        let scenery = Scenery::new(&flight, seed, 6, 8, Some(5.0));
        // The prior of a landmark is given with whichever observation comes first.
        let guessed = |id: u64| {
            let all = scenery.seen.iter().flatten();
            all.filter(|seen| seen.landmark == id).find_map(|seen| seen.guess)
        };
        let arrived = |order: &[usize]| {
            let mut smoother = seeing(&flight, converged(10), exact());
            (1..10).for_each(|k| flight.advance(&mut smoother, k));
            for k in order {
                for seen in &scenery.seen[*k] {
                    let seen = Observation { guess: guessed(seen.landmark), ..*seen };
                    smoother.observe(&mut open(), *k as u64, &seen).unwrap();
                }
                smoother.update().unwrap();
            }
            smoother
        };
        let in_order = arrived(&(0..10).collect::<Vec<_>>());
        agree(&in_order, &arrived(&order), (1e-6, 1e-5), variances_differ)?;
    }

    /// Without a guess, landmarks give no information on the origin and heading of the world, however often they are
    /// relinearised or marginalised.
    #[test]
    fn what_is_unobservable_stays_unknown(seed in any::<u64>()) {
        let mut flight = Flight::new(seed, 60, 1.0);
        for measured in &mut flight.measured {
            measured.retain(|factor| matches!(factor, NavigationFactor::RelativePose(_)));
        }
        flight.start.velocity_covariance *= 1e6;
        let scenery = Scenery::new(&flight, seed, 8, 100, None);
        let params = SmootherParams { relinearise_rotation: 1e-3, iterations: 2, ..linear(8) };
        let mut smoother = seeing(&flight, params, LandmarkParams::default());
        for k in 1..60 {
            flight.advance(&mut smoother, k);
            scenery.observe_in(&mut open(), &mut smoother, k);
            smoother.update().unwrap();
            let covariance = smoother.covariance().unwrap();
            prop_assert!(covariance[(8, 8)] >= 0.05 * 0.05 * (1.0 - 1e-3), "{k}: {}", covariance[(8, 8)]);
            prop_assert!(covariance[(0, 0)] + covariance[(1, 1)] >= 2.0 * (1.0 - 1e-3), "{k}");
        }
        prop_assert!(smoother.landmarks().1 > 0);
    }

    /// Arbitrary numbers leave it with finite numbers.
    #[test]
    fn absurd_observations(
        seed in any::<u64>(),
        numbers in proptest::collection::vec(prop_oneof![
            any::<f64>(), Just(f64::NAN), Just(f64::INFINITY), Just(1e300), Just(-1e-300), 0.0..480.0
        ], 42),
    ) {
        let flight = Flight::new(seed, 8, 1.0);
        let scenery = Scenery::new(&flight, seed, 4, 5, None);
        let mut smoother = scenery.flown(&flight, linear(6), LandmarkParams::default());
        let mut stream = Stream::default();
        for part in numbers.chunks(7) {
            let guess = (part[6] > 100.0).then(|| (Vector3::new(part[2], part[3], part[4]), part[5]));
            let pixel = Vector2::new(part[0], part[1]);
            let id = scenery.places.len() as u64 + (part[0].to_bits() % 3);
            for k in [5, 7] {
                let seen = Observation { guess, ..Observation::new(id, pixel, part[5]) };
                let _ = smoother.observe(&mut stream, k, &seen);
            }
        }
        smoother.update().unwrap();
        prop_assert!(smoother.estimate().unwrap().is_finite());
        prop_assert!(smoother.covariance().is_some());
    }
}

/// Turning the world and its landmarks gives the same result.
#[test]
fn heading_and_origin() {
    let flight = Flight::new(23, 25, 1.0);
    let scenery = Scenery::new(&flight, 23, 8, 15, Some(5.0));
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 2.0);
    let origin = Vector3::new(3000.0, -2000.0, 100.0);
    let place = |position: &Vector3<f64>| turn * position + origin;
    let other = Flight::new(23, 25, 1.0).elsewhere(&turn, &origin);
    let mut there = Scenery::new(&flight, 23, 8, 15, Some(5.0));
    for seen in there.seen.iter_mut().flatten() {
        seen.guess = seen.guess.map(|(known, deviation)| (place(&known), deviation));
    }
    let here = scenery.flown(&flight, usual(10), LandmarkParams::default());
    let there = there.flown(&other, usual(10), LandmarkParams::default());
    let (here, there) = (here.estimate().unwrap(), there.estimate().unwrap());
    let apart = (place(&here.position) - there.position).norm();
    let turned = (turn * here.world_from_body).angle_to(&there.world_from_body);
    // Depths that are almost unknown lose digits.
    assert!(apart < 1e-4 && turned < 1e-6, "{apart} m, {turned} rad");
}
