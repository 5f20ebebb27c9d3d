//! The camera against numeric derivatives, its inverse, and hand-computed values of OpenCV's model.

use bb_tests::laws;
use nalgebra::{Vector2, Vector3};
use proptest::prelude::*;

use super::Camera;
use crate::navigation::Refusal;

/// The lens of the first EuRoC camera.
fn lens() -> Camera {
    Camera {
        distortion: [-0.283, 0.0740, 0.012, 1.94e-4, 1.76e-5],
        ..Camera::pinhole((458.654, 457.296), (367.215, 248.375), (752.0, 480.0))
    }
}

laws! {
    #[test]
    fn derivatives_are_the_numeric_ones(
        x in -3.0..3.0_f64, y in -2.0..2.0_f64, z in 4.0..50.0_f64,
        distortion in proptest::array::uniform5(-0.05..0.05_f64),
    ) {
        let camera = Camera { distortion, ..lens() };
        let point = Vector3::new(x, y, z);
        let jacobian = camera.seen(&point).unwrap().jacobian;
        for axis in 0..3 {
            let step = Vector3::ith(axis, 1e-5);
            let [ahead, back] = [point + step, point - step].map(|point| camera.seen(&point).unwrap().pixel);
            let numeric = (ahead - back) / 2e-5;
            let apart = (numeric - jacobian.column(axis)).norm();
            prop_assert!(apart < 1e-6 * (1.0 + numeric.norm()), "{axis}: {numeric} {jacobian}");
        }
    }

    #[test]
    fn undistorting_is_the_inverse(u in 0.0..752.0_f64, v in 0.0..480.0_f64) {
        let camera = lens();
        let from = camera.undistorted(&Vector2::new(u, v)).unwrap();
        let seen = camera.seen(&from.direction.push(1.0)).unwrap();
        prop_assert!((seen.pixel - Vector2::new(u, v)).norm() < 1e-8);
        let apart = (seen.jacobian.fixed_columns::<2>(0) - from.jacobian).norm();
        prop_assert!(apart < 1e-6, "{apart}");
    }

    /// Any numbers either give a pixel or are refused.
    #[test]
    fn absurd_numbers(
        numbers in proptest::collection::vec(prop_oneof![
            any::<f64>(), Just(f64::NAN), Just(f64::INFINITY), Just(1e300), -10.0..10.0
        ], 10),
    ) {
        let distortion = core::array::from_fn(|i| numbers[i]);
        let camera = Camera { distortion, ..lens() };
        if let Ok(seen) = camera.seen(&Vector3::new(numbers[5], numbers[6], numbers[7])) {
            prop_assert!(seen.pixel.iter().chain(seen.jacobian.iter()).all(|x| x.is_finite()));
        }
        if let Ok(from) = camera.undistorted(&Vector2::new(numbers[8], numbers[9])) {
            prop_assert!(from.direction.iter().chain(from.jacobian.iter()).all(|x| x.is_finite()));
        }
    }
}

#[test]
fn the_model_is_that_of_opencv() {
    let camera = Camera {
        distortion: [0.1, 0.01, 0.001, 0.02, 0.03],
        ..Camera::pinhole((100.0, 200.0), (10.0, 20.0), (1e4, 1e4))
    };
    // x = 0.5, y = 1, r² = 1.25: radial = 1.142578125.
    let seen = camera.seen(&Vector3::new(1.0, 2.0, 2.0)).unwrap();
    let expected = Vector2::new(
        100.0 * (0.5 * 1.142_578_125 + 2.0 * 0.02 * 0.5 + 0.03 * (1.25 + 0.5)) + 10.0,
        200.0 * (1.142_578_125 + 0.02 * (1.25 + 2.0) + 2.0 * 0.03 * 0.5) + 20.0,
    );
    assert!((seen.pixel - expected).norm() < 1e-10, "{} {expected}", seen.pixel);
}

#[test]
fn what_cannot_be_seen_is_refused() {
    let camera = lens();
    for z in [0.0, -1.0, 1e-4] {
        assert_eq!(camera.seen(&Vector3::new(0.0, 0.0, z)), Err(Refusal::NotObservable));
    }
    assert_eq!(camera.seen(&Vector3::new(f64::NAN, 0.0, 1.0)), Err(Refusal::NonFinite));
    assert_eq!(camera.undistorted(&Vector2::new(f64::NAN, 0.0)), Err(Refusal::NonFinite));
    assert_eq!(camera.undistorted(&Vector2::new(-1.0, 5.0)), Err(Refusal::OutOfRange));
    assert_eq!(camera.undistorted(&Vector2::new(5.0, 480.5)), Err(Refusal::OutOfRange));
    // A lens whose distortion folds back before the corner.
    let folded = Camera { distortion: [-1.5, 0.0, 0.0, 0.0, 0.0], ..camera };
    assert_eq!(folded.undistorted(&Vector2::new(1.0, 1.0)), Err(Refusal::OutOfRange));
}
