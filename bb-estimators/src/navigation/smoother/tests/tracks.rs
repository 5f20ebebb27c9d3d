//! Tracks of landmarks, and what is left of them when their keyframes leave the window.

use bb_tests::laws;
use proptest::prelude::*;

use super::flight::{Flight, Smoother, agree, apart, linear, open, usual, variances_differ};
use super::scenery::{Scenery, exact, seeing};
use crate::navigation::{LandmarkParams, NAVIGATION, Stream};

/// A flight with a smoother that carries on every track, and in which every landmark keeps its first linearisation point, however far it
/// moves: the point of one that has outlived the window can no longer change, so in the batch it must not either.
fn carried(scenery: &Scenery, flight: &Flight, window: usize) -> Smoother {
    let mut smoother = seeing(flight, linear(window), exact());
    let landmarks = smoother.landmarks.as_mut().unwrap();
    (landmarks.known_within, landmarks.params.relinearise) = (f64::INFINITY, f64::INFINITY);
    scenery.fly(flight, &mut smoother, 0..30);
    smoother
}

laws! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Information that leaves the window is not lost, however long the tracks are.
    #[test]
    fn a_window_is_the_batch(seed in any::<u64>(), window in 6_usize..12, longest in 2_usize..40) {
        let flight = Flight::new(seed, 30, 1.0);
        let scenery = Scenery::new(&flight, seed, 6, longest, Some(5.0));
        let (mut batch, here) = (carried(&scenery, &flight, 30), carried(&scenery, &flight, window));
        // A flight whose first linearisation points do not do, one in a thousand, diverges and amplifies even rounding.
        let off = |id: u64| (batch.smoothed(id).unwrap().position - flight.truth[id as usize].position).norm();
        prop_assume!((0..30).map(off).fold(0.0, f64::max) < 5.0);
        agree(&here, &batch, (1e-9, 1e-9), variances_differ)?;
    }
}

/// Checks normalised errors of flights with the sensors that the smoother assumes.
fn are_as_large_as_it_says<const M: usize>(flights: u32, which: [&str; M], nees: impl Fn(u64) -> [f64; M]) {
    let all: Vec<_> = (1..=u64::from(flights)).map(nees).collect();
    // Three standard deviations of the mean of a χ² variable with this many degrees of freedom.
    let dimension = NAVIGATION as f64;
    let spread = 3.0 * (2.0 * dimension / f64::from(flights)).sqrt();
    for (i, which) in which.into_iter().enumerate() {
        let mean = all.iter().map(|of_flight| of_flight[i]).sum::<f64>() / f64::from(flights);
        assert!((mean - dimension).abs() < spread, "{which}: NEES {mean}, not {dimension} ± {spread}");
    }
}

/// Errors are as large as the smoother says at the newest keyframe and at the oldest, and with tracks that outlive the window.
#[test]
fn errors_are_as_large_as_the_smoother_says() {
    are_as_large_as_it_says(100, ["newest", "oldest"], |seed| {
        let flight = Flight::new(seed, 120, 1.0);
        let smoother = flight.flown(usual(10));
        [119, 110].map(|k| flight.nees(k, &smoother))
    });
    are_as_large_as_it_says(40, ["landmarks", "landmarks with a guess"], |seed| {
        let flight = Flight::new(seed, 60, 1.0);
        let scenery = |guess| Scenery::new(&flight, seed, 10, 100, guess);
        [None, Some(5.0)].map(|guess| flight.nees(59, &scenery(guess).flown(&flight, usual(8), exact())))
    });
}

/// Lost landmarks are eventually removed, and landmarks that outlive the window continue.
#[test]
fn landmarks_come_and_go() {
    let flight = Flight::new(17, 150, 1.0);
    let scenery = Scenery::new(&flight, 17, 10, 25, None);
    let mut smoother = seeing(&flight, usual(8), LandmarkParams { landmarks: 60, ..LandmarkParams::default() });
    let (mut stream, mut most) = (Stream::default(), 0);
    for k in 1..150 {
        flight.advance(&mut smoother, k);
        scenery.observe_in(&mut stream, &mut smoother, k);
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
    let mut smoother = scenery.flown(&flight, usual(6), exact());
    assert!(smoother.landmarks.as_ref().unwrap().coupling.points() > 0, "none outlives the window");
    smoother.start(0, &flight.start).unwrap();
    for k in 1..30 {
        flight.advance(&mut smoother, k);
        if k < 4 {
            scenery.observe_in(&mut open(), &mut smoother, k);
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
        let mut smoother = seeing(&flight, linear(8), LandmarkParams::default());
        scenery.fly(&flight, &mut smoother, 1..30);
        let (estimate, covariance) = (smoother.estimate().unwrap(), smoother.covariance().unwrap());
        smoother.set_camera(super::scenery::camera(), LandmarkParams::default()).unwrap();
        smoother.update().unwrap();
        assert!(apart(&estimate, &smoother.estimate().unwrap()) < 1e-9);
        assert!(variances_differ(&smoother.covariance().unwrap(), &covariance) < 1e-6);
        assert_eq!(smoother.landmarks(), (0, 0));
        // It goes on, with another window.
        scenery.fly(&flight, &mut smoother, 30..40);
        assert!(smoother.landmarks().1 > 3);
        // 99.9 % of a χ² variable with 15 degrees of freedom.
        let off = flight.nees(39, &smoother);
        assert!(off < 37.7, "{off}");
    }
}
