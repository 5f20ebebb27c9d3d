//! Tests of the transition over one IMU sample.

use bb_tests::laws;
use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;

use super::super::params::ImuDensities;
use super::super::propagation::Transition;
use super::{ALL, All, estimate};
use crate::navigation::covariance::Covariance;
use crate::navigation::math::rotation_vector;
use crate::navigation::state::{ACCELEROMETER_BIAS, Estimate, GYROSCOPE_BIAS, POSITION, ROTATION, VELOCITY};

const DENSITIES: ImuDensities =
    ImuDensities { accelerometer: 1e-4, gyroscope: 2e-6, accelerometer_bias: 3e-5, gyroscope_bias: 4e-8 };

/// The error of the navigation states that takes `from` to `to`.
fn error(from: &Estimate<ALL>, to: &Estimate<ALL>) -> SVector<f64, 15> {
    let mut error = SVector::<f64, 15>::zeros();
    let rotation = rotation_vector(&(to.world_from_body * from.world_from_body.inverse()));
    error.fixed_rows_mut::<3>(POSITION).copy_from(&(to.position - from.position));
    error.fixed_rows_mut::<3>(VELOCITY).copy_from(&(to.velocity - from.velocity));
    error.fixed_rows_mut::<3>(ROTATION).copy_from(&rotation);
    error.fixed_rows_mut::<3>(ACCELEROMETER_BIAS).copy_from(&(to.accelerometer_bias - from.accelerometer_bias));
    error.fixed_rows_mut::<3>(GYROSCOPE_BIAS).copy_from(&(to.gyroscope_bias - from.gyroscope_bias));
    error
}

laws! {
    #[test]
    fn is_the_derivative_of_the_mean(start in estimate(), dt in 1e-3..0.05) {
        let mut mean = start;
        let transition = Transition::advance(&mut mean, dt, 9.81).matrix::<15>();
        for state in 0..15 {
            let step = 1e-5;
            let moved = [step, -step].map(|step| {
                let mut error = SVector::zeros();
                error[state] = step;
                let mut moved = start.corrected::<All>(&error);
                Transition::advance(&mut moved, dt, 9.81);
                moved
            });
            let derivative = error(&moved[1], &moved[0]) / (2.0 * step);
            let difference = (derivative - transition.column(state)).amax();
            // The block of the gyroscope's bias neglects the third order in the rotation.
            let left_out = start.specific_force.norm() * (start.angular_velocity.norm() * dt * dt).powi(2) / 8.0;
            prop_assert!(difference < 2e-7 + left_out, "state {} differs by {}", state, difference);
        }
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
        start in estimate(), dt in 1e-3..0.1, numbers in proptest::collection::vec(-1.0..1.0, ALL * ALL),
    ) {
        let root = SMatrix::<f64, ALL, ALL>::from_iterator(numbers);
        let dense = root * root.transpose();
        let mut covariance = Covariance::<ALL>::new();
        for (i, row) in covariance.rows_mut().iter_mut().enumerate() {
            for (j, value) in row.iter_mut().enumerate() {
                *value = dense[(i.min(j), i.max(j))];
            }
        }
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
