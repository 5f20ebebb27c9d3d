//! The Kalman filter for the gyroscope's bias: section 3.4 of the paper.

use nalgebra::{Matrix3, Vector3};

use super::VqfParams;
use super::coefficients::InertialCoefficients;
use super::low_pass::LowPass;
use crate::attitude::Real;

/// The gyroscope's bias and its uncertainty.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Bias<T> {
    /// rad/s, body frame.
    pub(super) bias: Vector3<T>,
    /// (rad/s)², body frame.
    covariance: Matrix3<T>,
    /// The rotation from body to the level frame, and the horizontal part of the bias in that, both low-passed as
    /// the specific force is: the corrections of the inclination are delayed by the same time.
    rotations: LowPass<T, 9>,
    biases: LowPass<T, 2>,
}

impl<T: Real> Bias<T> {
    pub(super) fn new(params: &VqfParams) -> Self {
        let variance = T::of(params.initial_bias * params.initial_bias);
        Self {
            bias: Vector3::zeros(),
            covariance: Matrix3::from_diagonal_element(variance),
            rotations: LowPass::new(),
            biases: LowPass::new(),
        }
    }

    /// Restarts the low-passes; the bias and its uncertainty are kept.
    pub(super) fn forget_motion(&mut self) {
        self.rotations = LowPass::new();
        self.biases = LowPass::new();
    }

    /// The gyroscope's reading at rest is the bias: `rate` is low-passed, rad/s.
    #[inline]
    pub(super) fn rest(&mut self, params: &VqfParams, coefficients: &InertialCoefficients<T>, rate: &Vector3<T>) {
        self.grow(coefficients);
        let mut innovation = (rate - self.bias).cap_magnitude(T::of(params.largest_bias));
        let mut change = Vector3::zeros();
        for axis in 0..3 {
            innovation[axis] -= change[axis];
            let variance = self.covariance[(axis, axis)] + coefficients.rest_variance;
            let column: Vector3<T> = self.covariance.column(axis).into();
            let gain = column * (T::ONE / variance);
            change += gain * innovation[axis];
            self.covariance -= gain * column.transpose();
        }
        self.correct(params, change);
    }

    /// The correction of the inclination shows the remaining bias, horizontally.
    ///
    /// `leaning` is the unit vector of the low-passed specific force in the level frame before the correction,
    /// `level_from_body` the orientation after it. Nothing shows the vertical part of the bias; a weak measurement
    /// of none keeps it from wandering.
    #[inline]
    pub(super) fn motion(
        &mut self,
        params: &VqfParams,
        dt_s: T,
        coefficients: &InertialCoefficients<T>,
        leaning: &Vector3<T>,
        level_from_body: &Matrix3<T>,
    ) {
        let rotation = self.low_pass(dt_s, coefficients, level_from_body);
        self.grow(coefficients);
        let expected = rotation.0 * self.bias;
        let horizontal = nalgebra::Vector2::new(
            -leaning.y / dt_s + rotation.1[0] - expected.x,
            leaning.x / dt_s + rotation.1[1] - expected.y,
        )
        .cap_magnitude(T::of(params.largest_bias));
        let vertical = (-expected.z).clamp(-T::of(params.largest_bias), T::of(params.largest_bias));
        let measurements = [
            (horizontal.x, coefficients.motion_variance),
            (horizontal.y, coefficients.motion_variance),
            (vertical, coefficients.vertical_variance),
        ];
        // The noises are independent, so the three are fused one after the other and no matrix is inverted.
        let mut change = Vector3::zeros();
        for (row, (innovation, variance)) in measurements.into_iter().enumerate() {
            let observation: Vector3<T> = rotation.0.row(row).transpose();
            let column = self.covariance * observation;
            let gain = column * (T::ONE / (observation.dot(&column) + variance));
            change += gain * (innovation - observation.dot(&change));
            self.covariance -= gain * column.transpose();
        }
        self.correct(params, change);
    }

    /// Low-passes rotation and bias, also while nothing is measured in motion.
    #[inline]
    pub(super) fn low_pass(
        &mut self,
        dt_s: T,
        coefficients: &InertialCoefficients<T>,
        level_from_body: &Matrix3<T>,
    ) -> (Matrix3<T>, [T; 2]) {
        let bias = level_from_body * self.bias;
        let biases = self.biases.filter(&[bias.x, bias.y], dt_s, &coefficients.tilt);
        let elements = core::array::from_fn(|i| level_from_body.as_slice()[i]);
        let elements = self.rotations.filter(&elements, dt_s, &coefficients.tilt);
        (Matrix3::from_column_slice(&elements), biases)
    }

    /// The known bias fades.
    fn grow(&mut self, coefficients: &InertialCoefficients<T>) {
        self.covariance *= coefficients.bias_kept;
        for axis in 0..3 {
            self.covariance[(axis, axis)] += coefficients.bias_growth;
        }
    }

    fn correct(&mut self, params: &VqfParams, change: Vector3<T>) {
        self.bias = (self.bias + change).cap_magnitude(T::of(params.largest_bias));
    }
}
