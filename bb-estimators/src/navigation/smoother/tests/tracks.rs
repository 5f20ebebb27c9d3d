//! Tracks of landmarks, and what is left of them when their keyframes leave the window.

use bb_tests::laws;
use proptest::prelude::*;

use super::flight::{Flight, N, Smoother, apart, linear, sensors};
use super::scenery::{Scenery, camera, exact};
use crate::navigation::{LandmarkParams, NAVIGATION, SmootherParams, Stream, nees};

/// A smoother that carries on every track, and in which every landmark keeps its first linearisation point, however far it moves: the
/// point of one that has outlived the window can no longer change, so in the batch it must not either.
fn carrying(window: usize) -> Smoother {
    let mut smoother = Smoother::new(linear(window)).unwrap();
    smoother.set_camera(camera(), exact()).unwrap();
    let landmarks = smoother.landmarks.as_mut().unwrap();
    (landmarks.known_within, landmarks.params.relinearise) = (f64::INFINITY, f64::INFINITY);
    smoother
}

laws! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Information that leaves the window is not lost, however long the tracks are.
    #[test]
    fn a_window_is_the_batch(seed in any::<u64>(), window in 6_usize..12, longest in 2_usize..40) {
        let flight = Flight::new(seed, 30, 1.0);
        let scenery = Scenery::new(&flight, seed, 6, longest, Some(5.0));
        let mut batch = scenery.carried(&flight, carrying(30));
        let mut here = scenery.carried(&flight, carrying(window));
        // A flight whose first linearisation points do not do, one in a thousand, diverges and amplifies even rounding.
        let off = |id: u64| (batch.smoothed(id).unwrap().position - flight.truth[id as usize].position).norm();
        prop_assume!((0..30).map(off).fold(0.0, f64::max) < 5.0);
        for id in here.keyframes().collect::<Vec<_>>() {
            let (all, some) = (batch.smoothed(id).unwrap(), here.smoothed(id).unwrap());
            prop_assert!(apart(&all, &some) < 1e-9, "{id}: {}", apart(&all, &some));
            let (all, some) = (batch.smoothed_covariance(id).unwrap(), here.smoothed_covariance(id).unwrap());
            for i in 0..N {
                prop_assert!((all[(i, i)] / some[(i, i)] - 1.0).abs() < 1e-9, "{id}, {i}");
            }
        }
    }
}

/// Errors are as large as the smoother says if the sensors err exactly as it assumes, also with tracks that outlive the
/// window.
#[test]
fn errors_are_as_large_as_the_smoother_says() {
    const FLIGHTS: u32 = 40;
    const KEYFRAMES: usize = 60;
    for guess in [None, Some(5.0)] {
        let params = SmootherParams { sensors: sensors(), window: 8, ..SmootherParams::default() };
        let mut sum = 0.0;
        for seed in 1..=u64::from(FLIGHTS) {
            let flight = Flight::new(seed, KEYFRAMES, 1.0);
            let scenery = Scenery::new(&flight, seed, 10, 100, guess);
            let smoother = scenery.flown(&flight, Smoother::new(params).unwrap(), exact());
            let covariance = smoother.covariance().unwrap();
            let of_navigation = covariance.fixed_view::<NAVIGATION, NAVIGATION>(0, 0).into_owned();
            let error = flight.error(KEYFRAMES - 1, &smoother.estimate().unwrap());
            sum += nees(&error, &of_navigation).unwrap() / f64::from(FLIGHTS);
        }
        let dimension = NAVIGATION as f64;
        let spread = 3.0 * (2.0 * dimension / f64::from(FLIGHTS)).sqrt();
        assert!((sum - dimension).abs() < spread, "{guess:?}: NEES {sum}, not {dimension} ± {spread}");
    }
}

/// Lost landmarks are eventually removed, and landmarks that outlive the window continue.
#[test]
fn landmarks_come_and_go() {
    let flight = Flight::new(17, 150, 1.0);
    let scenery = Scenery::new(&flight, 17, 10, 25, None);
    let mut smoother =
        Smoother::new(SmootherParams { sensors: sensors(), window: 8, ..SmootherParams::default() }).unwrap();
    smoother.set_camera(camera(), LandmarkParams { landmarks: 60, ..LandmarkParams::default() }).unwrap();
    smoother.start(0, &flight.start).unwrap();
    let (mut stream, mut most) = (Stream::default(), 0);
    for k in 1..150 {
        flight.fly_to(&mut smoother, k);
        flight.measure(&mut smoother, k);
        for seen in &scenery.seen[k] {
            let _ = smoother.observe(&mut stream, k as u64, seen);
        }
        smoother.update().unwrap();
        most = most.max(smoother.landmarks().0);
    }
    assert!(scenery.places.len() > 100 && most < 50, "{} {most}", scenery.places.len());
    let counts = stream.counts();
    assert_eq!(counts.not_applicable, 0, "{counts:?}");
    assert!(counts.fused > 900, "{counts:?}");
    assert!(smoother.landmarks().1 > 5);
}

/// Room is freed after a restart: the times of the last observations do not outlive it.
#[test]
fn room_is_freed_after_a_restart() {
    let flight = Flight::new(17, 60, 1.0);
    let scenery = Scenery::new(&flight, 17, 10, 25, Some(5.0));
    let params = SmootherParams { sensors: sensors(), window: 6, ..SmootherParams::default() };
    let mut smoother = scenery.flown(&flight, Smoother::new(params).unwrap(), exact());
    assert!(smoother.landmarks.as_ref().unwrap().coupling.points() > 0, "none outlives the window");
    smoother.start(0, &flight.start).unwrap();
    for k in 1..30 {
        flight.fly_to(&mut smoother, k);
        flight.measure(&mut smoother, k);
        if k < 4 {
            for seen in &scenery.seen[k] {
                let _ = smoother.observe(&mut super::flight::open(), k as u64, seen);
            }
        }
        smoother.update().unwrap();
    }
    assert_eq!(smoother.landmarks(), (0, 0));
}

/// Another camera in flight changes neither the estimate nor its covariance: the landmarks go, but not what they have said.
#[test]
fn another_camera_may_be_set_in_flight() {
    let flight = Flight::new(29, 40, 1.0);
    for (longest, guess) in [(100, None), (4, Some(5.0))] {
        let scenery = Scenery::new(&flight, 29, 10, longest, guess);
        let params = SmootherParams { window: 8, ..linear(8) };
        let mut smoother = Smoother::new(params).unwrap();
        smoother.set_camera(camera(), LandmarkParams::default()).unwrap();
        smoother.start(0, &flight.start).unwrap();
        for k in 1..30 {
            flight.fly_to(&mut smoother, k);
            flight.measure(&mut smoother, k);
            scenery.observe(&mut smoother, k);
            smoother.update().unwrap();
        }
        let (estimate, covariance) = (smoother.estimate().unwrap(), smoother.covariance().unwrap());
        smoother.set_camera(camera(), LandmarkParams::default()).unwrap();
        smoother.update().unwrap();
        assert!(apart(&estimate, &smoother.estimate().unwrap()) < 1e-9);
        let after = smoother.covariance().unwrap();
        for i in 0..N {
            assert!((after[(i, i)] / covariance[(i, i)] - 1.0).abs() < 1e-6, "{i}");
        }
        assert_eq!(smoother.landmarks(), (0, 0));
        // It goes on, with another window.
        for k in 30..40 {
            flight.fly_to(&mut smoother, k);
            flight.measure(&mut smoother, k);
            scenery.observe(&mut smoother, k);
            smoother.update().unwrap();
        }
        assert!(smoother.landmarks().1 > 3);
        let covariance = smoother.covariance().unwrap().fixed_view::<NAVIGATION, NAVIGATION>(0, 0).into_owned();
        let off = nees(&flight.error(39, &smoother.estimate().unwrap()), &covariance).unwrap();
        // 99.9 % of a χ² variable with 15 degrees of freedom.
        assert!(off < 37.7, "{off}");
    }
}
