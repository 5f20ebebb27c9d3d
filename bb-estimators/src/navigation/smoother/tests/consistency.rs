//! Consistency: if the sensors err exactly as the smoother assumes, its errors match its covariance, at the newest
//! keyframe and at the oldest in the window.

use super::flight::{Flight, sensors};
use crate::navigation::{NAVIGATION, SmootherParams, nees};

#[test]
fn errors_are_as_large_as_the_smoother_says() {
    const FLIGHTS: u32 = 100;
    const KEYFRAMES: usize = 120;
    let params = SmootherParams { sensors: sensors(), window: 10, ..SmootherParams::default() };
    let mut sums = [0.0; 2];
    for seed in 1..=u64::from(FLIGHTS) {
        let flight = Flight::new(seed, KEYFRAMES, 1.0);
        let mut smoother = flight.flown(params);
        let oldest = smoother.keyframes().next().unwrap();
        for (sum, k) in sums.iter_mut().zip([KEYFRAMES as u64 - 1, oldest]) {
            let estimate = smoother.smoothed(k).unwrap();
            let covariance = smoother.smoothed_covariance(k).unwrap();
            let of_navigation = covariance.fixed_view::<NAVIGATION, NAVIGATION>(0, 0).into_owned();
            *sum += nees(&flight.error(k as usize, &estimate), &of_navigation).unwrap() / f64::from(FLIGHTS);
        }
    }
    // Three standard deviations of the mean of a χ² variable with this many degrees of freedom.
    let dimension = NAVIGATION as f64;
    let spread = 3.0 * (2.0 * dimension / f64::from(FLIGHTS)).sqrt();
    for (mean, which) in sums.into_iter().zip(["newest", "oldest"]) {
        assert!((mean - dimension).abs() < spread, "{which}: NEES {mean}, not {dimension} ± {spread}");
    }
}
