//! Preintegration against the sample-by-sample filter, numeric differentiation and reintegration.

use bb_tests::laws;
use nalgebra::{SVector, UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::super::preintegration::Preintegration;
use super::flight::{derivative, matrix};
use crate::navigation::math::rotation_vector;
use crate::navigation::{EskfFilter, EskfParams, ImuDensities, ImuMean, NAVIGATION, Start};

const DT: f64 = 0.005;

/// A sample of a body that turns and shakes.
fn motion(seed: f64) -> impl Fn(usize) -> (Vector3<f64>, Vector3<f64>) {
    move |i| {
        let t = i as f64 * DT + seed;
        let turn = Vector3::new((3.0 * t).sin(), 2.0 * (2.3 * t).cos(), 1.5 * (0.7 * t).sin());
        (turn, Vector3::new(5.0 * (9.0 * t).cos(), (4.0 * t).sin(), 9.8 + 3.0 * (7.0 * t).sin()))
    }
}

fn integrated(seed: f64, samples: usize, biases: &SVector<f64, 6>, densities: &ImuDensities) -> Preintegration {
    let mut all = Preintegration::new(biases.fixed_rows::<3>(0).into(), biases.fixed_rows::<3>(3).into());
    let sample = motion(seed);
    for i in 0..samples {
        let (turn, force) = sample(i);
        all.add(&turn, &force, DT, densities);
    }
    all
}

fn params() -> EskfParams {
    EskfParams {
        gyroscope_noise: 2e-3,
        accelerometer_noise: 3e-2,
        gyroscope_bias_walk: 4e-3,
        accelerometer_bias_walk: 5e-2,
        ..EskfParams::default()
    }
}

fn densities() -> ImuDensities {
    params().densities()
}

laws! {
    /// Mean and covariance match those of the filter without gravity, from a known state.
    #[test]
    fn it_is_the_filter_in_one_step(seed in 0.0..100.0, samples in 1_usize..200) {
        let biases = SVector::<f64, 6>::new(0.1, -0.2, 0.05, 0.01, -0.02, 0.005);
        let all = integrated(seed, samples, &biases, &densities());
        let mut filter: EskfFilter = EskfFilter::new(EskfParams { gravity: 1.0, ..params() }).unwrap();
        // As small as the filter allows.
        let known = 1e-9;
        let rest = (Vector3::zeros(), known);
        let start = Start {
            accelerometer_bias: biases.fixed_rows::<3>(0).into(),
            gyroscope_bias: biases.fixed_rows::<3>(3).into(),
            accelerometer_bias_deviation: known,
            gyroscope_bias_deviation: known,
            ..Start::at(0, rest, rest, (UnitQuaternion::identity(), known))
        };
        filter.start(&start).unwrap();
        let sample = motion(seed);
        for i in 0..samples {
            let (angular_velocity, specific_force) = sample(i);
            let time_ns = (i as i64 + 1) * 5_000_000;
            filter.propagate(&ImuMean { time_ns, angular_velocity, specific_force }).unwrap();
        }
        let seconds = all.seconds();
        let fall = Vector3::new(0.0, 0.0, -seconds);
        let estimate = filter.estimate().unwrap();
        prop_assert!((all.velocity() + fall - estimate.velocity).norm() < 1e-11);
        prop_assert!((all.position() + fall * (0.5 * seconds) - estimate.position).norm() < 1e-11);
        prop_assert!(all.rotation().angle_to(&estimate.world_from_body) < 1e-7);
        let covariance = matrix(&all.covariance());
        let scale = |i: usize, j: usize| (covariance[(i, i)] * covariance[(j, j)]).sqrt() + 1e-15;
        for i in 0..NAVIGATION {
            for j in 0..NAVIGATION {
                let apart = (covariance[(i, j)] - filter.covariance()[(i, j)]).abs();
                prop_assert!(apart < 1e-6 * scale(i, j), "{i} {j}: {apart} of {}", scale(i, j));
            }
        }
        prop_assert!(covariance.cholesky().is_some());
    }

    /// Derivatives by the biases, against reintegration with other biases.
    #[test]
    fn derivatives_by_biases(seed in 0.0..100.0, samples in 1_usize..60) {
        let at = SVector::<f64, 6>::new(0.1, -0.2, 0.05, 0.01, -0.02, 0.005);
        let here = integrated(seed, samples, &at, &densities());
        let rotation = here.rotation().inverse();
        let numeric = derivative::<9, 6>(1e-5, |error| {
            let moved = integrated(seed, samples, &(at + error), &densities());
            let turned = rotation_vector(&(moved.rotation() * rotation));
            SVector::from_iterator(moved.position().iter().chain(moved.velocity()).chain(&turned).copied())
        });
        let parts = [
            ("position", &here.by_accelerometer.position, &here.by_gyroscope.position),
            ("velocity", &here.by_accelerometer.velocity, &here.by_gyroscope.velocity),
            ("rotation", &here.by_accelerometer.rotation, &here.by_gyroscope.rotation),
        ];
        for (i, (what, by_accelerometer, by_gyroscope)) in parts.into_iter().enumerate() {
            for (first, exact) in [(0, by_accelerometer), (3, by_gyroscope)] {
                let off = numeric.fixed_view::<3, 3>(3 * i, first) - exact;
                let apart = off.column_iter().map(|column| column.norm()).fold(0.0, f64::max);
                // The derivative of the mean over one sample is of second order in its turn.
                prop_assert!(apart < 1e-5 * here.seconds(), "{what} by {first}: {apart} after {} s", here.seconds());
            }
        }
    }
}
