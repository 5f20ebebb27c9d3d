//! Tests of the transition over one IMU sample.

use bb_tests::laws;
use nalgebra::SVector;
use proptest::prelude::*;

use super::super::params::ImuDensities;
use super::super::propagation::Transition;
use super::{ALL, All, covariance, derivative, estimate};
use crate::navigation::state::Estimate;

const DENSITIES: ImuDensities =
    ImuDensities { accelerometer: 1e-4, gyroscope: 2e-6, accelerometer_bias: 3e-5, gyroscope_bias: 4e-8 };

/// The error of the navigation states that takes `from` to `to`.
fn error(from: &Estimate<ALL>, to: &Estimate<ALL>) -> SVector<f64, 15> {
    from.error_to::<All>(to).fixed_rows::<15>(0).into_owned()
}

laws! {
    #[test]
    fn is_the_derivative_of_the_mean(start in estimate(), dt in 1e-3..0.05) {
        let mut mean = start;
        let transition = Transition::advance(&mut mean, dt, 9.81).matrix::<15>();
        let numeric = derivative::<15, 15>(1e-5, |change| {
            let mut moved = start.corrected::<All>(&change.fixed_resize::<ALL, 1>(0.0));
            Transition::advance(&mut moved, dt, 9.81);
            error(&mean, &moved)
        });
        // The block of the gyroscope's bias neglects the third order in the rotation.
        let left_out = start.specific_force.norm() * (start.angular_velocity.norm() * dt * dt).powi(2) / 8.0;
        prop_assert!((numeric - transition).amax() < 2e-7 + left_out, "{} is not {}", transition, numeric);
    }

    #[test]
    fn is_exact_while_rate_and_force_are_constant(start in estimate(), dt in 1e-3..0.1) {
        let mut at_once = start;
        Transition::advance(&mut at_once, dt, 9.81);
        let mut in_steps = start;
        for _ in 0..50 {
            Transition::advance(&mut in_steps, dt / 50.0, 9.81);
        }
        prop_assert!(error(&at_once, &in_steps).amax() < 1e-11, "{}", error(&at_once, &in_steps));
    }

    #[test]
    fn moves_the_covariance_as_the_whole_matrix_does(
        start in estimate(), dt in 1e-3..0.1, root in proptest::collection::vec(-1.0..1.0, ALL * ALL),
    ) {
        let (dense, mut covariance) = covariance::<ALL>(root);
        let mut mean = start;
        let transition = Transition::advance(&mut mean, dt, 9.81);
        transition.apply(covariance.rows_mut(), &DENSITIES);
        let matrix = transition.matrix::<ALL>();
        let mut expected = matrix * dense * matrix.transpose();
        for i in 0..3 {
            let q = DENSITIES.accelerometer;
            expected[(i, i)] += q * dt.powi(3) / 3.0;
            expected[(i, i + 3)] += q * dt * dt / 2.0;
            expected[(i + 3, i)] += q * dt * dt / 2.0;
            expected[(i + 3, i + 3)] += q * dt;
            expected[(i + 6, i + 6)] += DENSITIES.gyroscope * dt;
            expected[(i + 9, i + 9)] += DENSITIES.accelerometer_bias * dt;
            expected[(i + 12, i + 12)] += DENSITIES.gyroscope_bias * dt;
        }
        let moved = covariance.matrix();
        prop_assert!((moved - expected).amax() < 1e-11 * expected.amax());
        prop_assert_eq!(moved, &moved.transpose());
    }
}
