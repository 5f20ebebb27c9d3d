//! Least squares for the magnetometer's offset and lag, as sums over windows.
//!
//! With R̄ the mean rotation over a window's field samples, w the mean of R m and q that of R (ω × (m - b)),
//! `w = B + R̄ b + τ q`: an unknown field B in the world, the offset b on the body and the lag τ, seven numbers. B is
//! eliminated; what is left is a system of four.
//!
//! The rotations are relative to each other, and no better known than the gyroscope's bias about the vertical: where the heading
//! may have drifted by more than the errors of the field, that counts.

use nalgebra::{Matrix3, Matrix4, UnitQuaternion, Vector3, Vector4};

use crate::attitude::Real;
use crate::attitude::initial::MIN_HORIZONTAL_FRACTION;

/// Variance of a heading that may be any, rad².
const ANY_HEADING: f64 = core::f64::consts::PI * core::f64::consts::PI / 3.0;

/// The assumed error of a field before any is seen, as a fraction of its norm, and its weight as a duration, s: seven
/// numbers fit the first second too well.
const PRIOR_ERROR: f64 = 0.01;
const PRIOR_S: f64 = 2.0;

/// The correlation time of the field's errors, s.
const CORRELATION_S: f64 = 0.25;

/// The smallest standard deviation of a field indoors, as a fraction of its norm: no room is more uniform than that.
const LEAST_ERROR: f64 = 0.01;

/// Prior standard deviation of the offset on each axis, as a fraction of the field's norm: that of uncalibrated
/// chips.
pub(in super::super) const PRIOR_OFFSET: f64 = 0.5;

/// Means over the field samples of one window, in the world but for the offset's own frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) struct FieldMeans<T> {
    /// R̄.
    pub(in super::super) rotation: Matrix3<T>,
    /// w.
    pub(in super::super) field: Vector3<T>,
    /// q, the field's unit times rad/s.
    pub(in super::super) rate: Vector3<T>,
}

/// Integrals over time.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Sums<T> {
    /// ∫ dt, s.
    pub(super) duration: T,
    /// ∫ dt times the variance of the gyroscope's bias about the vertical, rad²/s.
    drift: T,
    rotation: Matrix3<T>,
    field: Vector3<T>,
    field_on_body: Vector3<T>,
    squared_field: T,
    rate: Vector3<T>,
    rate_on_body: Vector3<T>,
    squared_rate: T,
    rate_times_field: T,
}

/// The prior of the lag when the sums began: its mean, s, and variance, s².
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lag<T> {
    pub(super) mean: T,
    pub(super) variance: T,
}

/// The sums with B eliminated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fit<T> {
    duration: T,
    /// Without the prior, `cost(x) = S₀ - 2 cᵀ x + xᵀ A x`.
    matrix: Matrix4<T>,
    vector: Vector4<T>,
    constant: T,
    /// The minimum: offset, and lag in s.
    pub(super) offset: Vector3<T>,
    pub(super) lag: T,
    /// Covariance of both.
    pub(super) covariance: Matrix4<T>,
    /// The determinant of the offset's information, with any lag: that of its covariance, by the noise, is one by this.
    offset_determinant: T,
    /// B there, in the world.
    pub(super) field: Vector3<T>,
    /// ∂B/∂x, negated: the means of R and q.
    pub(super) slope: Matrix3<T>,
    rate: Vector3<T>,
    /// The weight of one independent second of cost: the variance of the field's error times its correlation, unit²
    /// s.
    pub(super) noise: T,
}

impl<T: Real> Sums<T> {
    pub(super) fn new() -> Self {
        Self {
            duration: T::ZERO,
            drift: T::ZERO,
            rotation: Matrix3::zeros(),
            field: Vector3::zeros(),
            field_on_body: Vector3::zeros(),
            squared_field: T::ZERO,
            rate: Vector3::zeros(),
            rate_on_body: Vector3::zeros(),
            squared_rate: T::ZERO,
            rate_times_field: T::ZERO,
        }
    }

    /// Adds a window of `dt` seconds, after earlier data has faded by `keep`; `drift` is the variance of the gyroscope's bias
    /// about the vertical, (rad/s)².
    pub(super) fn add(&mut self, dt: T, keep: T, means: &FieldMeans<T>, drift: T) {
        let FieldMeans { rotation, field, rate } = means;
        self.duration = self.duration * keep + dt;
        self.drift = self.drift * keep + drift * dt;
        self.rotation = self.rotation * keep + rotation * dt;
        self.field = self.field * keep + field * dt;
        self.field_on_body = self.field_on_body * keep + rotation.tr_mul(field) * dt;
        self.squared_field = self.squared_field * keep + field.norm_squared() * dt;
        self.rate = self.rate * keep + rate * dt;
        self.rate_on_body = self.rate_on_body * keep + rotation.tr_mul(rate) * dt;
        self.squared_rate = self.squared_rate * keep + rate.norm_squared() * dt;
        self.rate_times_field = self.rate_times_field * keep + rate.dot(field) * dt;
    }

    /// The mean of the fields less an offset, in the world; `None` without data.
    pub(super) fn mean_field(&self, offset: &Vector3<T>) -> Option<Vector3<T>> {
        (self.duration > T::ZERO).then(|| (self.field - self.rotation * offset) / self.duration)
    }

    /// Turns the world.
    pub(super) fn turn(&mut self, correction: &UnitQuaternion<T>) {
        self.rotation = correction.to_rotation_matrix() * self.rotation;
        self.field = correction * self.field;
        self.rate = correction * self.rate;
    }

    /// The power density of what the heading may have drifted by since the sums began, rad² s, where the offset is seen: at the
    /// frequency of the body's rotation, whose `spread` is ∫ |R̄ - mean|² dt. A ramp of height 1 over D seconds has a variance
    /// of 1/12, over all of D at the lowest frequencies; its part at ω has an amplitude of 2 / (ω D).
    fn drift_density(&self, spread: T, unit: T) -> T {
        let squared_height = self.drift * self.duration;
        // |q|² is ω² |B|² times 2/3 in the mean, and |Ṙ|² is 2 ω².
        let squared_frequency =
            T::of(3.0) * self.squared_rate / (unit * unit * spread.max(T::of(1e-6) * self.duration));
        let turned = squared_frequency * self.duration * self.duration;
        squared_height * self.duration / (T::of(12.0) + turned / T::of(4.0))
    }

    /// Solves for offset and lag; `unit` is the norm of the field. `None` without data.
    pub(super) fn fit(&self, unit: T, prior: Lag<T>) -> Option<Fit<T>> {
        let scale = T::ONE / self.duration;
        let slope = self.rotation * scale;
        let mean_rate = self.rate * scale;
        let mean_field = self.field * scale;
        // R̄ᵀ R̄ is the identity up to the rotation within a window.
        let offset_block = Matrix3::identity() * self.duration - self.rotation.tr_mul(&slope);
        let cross = self.rate_on_body - self.rotation.tr_mul(&mean_rate);
        let mut matrix = Matrix4::zeros();
        matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&offset_block);
        for i in 0..3 {
            matrix[(i, 3)] = cross[i];
            matrix[(3, i)] = cross[i];
        }
        matrix[(3, 3)] = self.squared_rate - self.rate.dot(&mean_rate);
        let on_body = self.field_on_body - self.rotation.tr_mul(&mean_field);
        let lagged = self.rate_times_field - self.rate.dot(&mean_field);
        let vector = Vector4::new(on_body.x, on_body.y, on_body.z, lagged);
        let constant = (self.squared_field - self.field.dot(&mean_field)).max(T::ZERO);

        let correlation = T::TWO * T::of(CORRELATION_S);
        let least = T::of(LEAST_ERROR * LEAST_ERROR) * unit * unit;
        let mut regular = matrix;
        let mut right = vector;
        let offset_information = least * correlation / (T::of(PRIOR_OFFSET * PRIOR_OFFSET) * unit * unit);
        let lag_information = least * correlation / prior.variance;
        for i in 0..3 {
            regular[(i, i)] += offset_information;
        }
        regular[(3, 3)] += lag_information;
        right[3] += lag_information * prior.mean;
        let factor = regular.cholesky()?;
        // By Schur's complement. Every factor is positive; the determinant of the covariance of a body that turns about
        // one axis is a difference below the rounding of its terms in `f32`.
        let root = factor.l_dirty().diagonal().product();
        let offset_determinant = root * root / regular[(3, 3)];
        let inverse = factor.inverse();
        let solution = inverse * right;
        let mut fit = Fit {
            duration: self.duration,
            matrix,
            vector,
            constant,
            offset: solution.xyz(),
            lag: solution.w,
            covariance: inverse,
            offset_determinant,
            field: mean_field - slope * solution.xyz() - mean_rate * solution.w,
            slope,
            rate: mean_rate,
            noise: T::ZERO,
        };
        let prior = T::of(PRIOR_ERROR * PRIOR_ERROR) * unit * unit * T::of(PRIOR_S);
        let error = ((fit.cost(&solution) + prior) / (self.duration + T::of(PRIOR_S))).max(least);
        let across = fit.field.x * fit.field.x + fit.field.y * fit.field.y;
        fit.noise = (error * correlation).max(self.drift_density(offset_block.trace(), unit) * across);
        fit.covariance = inverse * fit.noise;
        Some(fit)
    }
}

impl<T: Real> Fit<T> {
    /// ∫ |error|² dt at an offset and a lag.
    fn cost(&self, x: &Vector4<T>) -> T {
        (self.constant - T::TWO * self.vector.dot(x) + x.dot(&(self.matrix * x))).max(T::ZERO)
    }

    /// The trace of the offset's covariance.
    pub(super) fn offset_trace(&self) -> T {
        self.covariance[(0, 0)] + self.covariance[(1, 1)] + self.covariance[(2, 2)]
    }

    /// How much the data tells about the offset: the logarithm of the ratio of its prior and its own volume, squared.
    pub(super) fn offset_information(&self, unit: T) -> T {
        let prior = T::of(PRIOR_OFFSET) * unit;
        let noise = self.noise / (prior * prior);
        // The prior is scaled by the noise of the fit, so that little data may seem to say less than nothing.
        (self.offset_determinant / (noise * noise * noise)).ln().max(T::ZERO)
    }

    /// The field in the world with an offset and a lag.
    pub(super) fn field_of(&self, offset: &Vector3<T>, lag: T) -> Vector3<T> {
        self.field + self.slope * (self.offset - offset) + self.rate * (self.lag - lag)
    }

    /// The least cost of all.
    pub(super) fn least_cost(&self) -> T {
        self.cost(&Vector4::new(self.offset.x, self.offset.y, self.offset.z, self.lag))
    }

    /// The cost with this offset and its best lag, and that lag, s.
    pub(super) fn cost_of(&self, offset: &Vector3<T>, prior: Lag<T>) -> (T, T) {
        let information = self.noise / prior.variance;
        let cross = Vector3::new(self.matrix[(0, 3)], self.matrix[(1, 3)], self.matrix[(2, 3)]);
        let lag =
            (self.vector.w - cross.dot(offset) + information * prior.mean) / (self.matrix[(3, 3)] + information);
        (self.cost(&Vector4::new(offset.x, offset.y, offset.z, lag)), lag)
    }

    /// Mean square error of a cost, in the field's unit squared.
    pub(super) fn mean_square(&self, cost: T) -> T {
        cost / self.duration
    }

    /// Variance of the direction of B about the vertical, rad².
    pub(super) fn heading_variance(&self) -> T {
        let [x, y] = [self.field.x, self.field.y];
        let squared = x * x + y * y;
        let least = T::of(MIN_HORIZONTAL_FRACTION * MIN_HORIZONTAL_FRACTION) * self.field.norm_squared();
        if squared <= least {
            return T::of(ANY_HEADING);
        }
        let across = Vector3::new(y, -x, T::ZERO) / squared;
        let on_body = self.slope.tr_mul(&across);
        let gradient = Vector4::new(on_body.x, on_body.y, on_body.z, self.rate.dot(&across));
        gradient.dot(&(self.covariance * gradient)) + self.noise / (self.duration * squared)
    }

    /// Mean square error of a heading in use, rad², which may be that of another offset or field: how far B is from north, and
    /// how uncertain that is.
    pub(super) fn squared_heading_error(&self) -> T {
        let angle = self.field.x.atan2(self.field.y);
        angle * angle + self.heading_variance()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT_S: f64 = 0.08;
    const FIELD: Vector3<f64> = Vector3::new(0.0, 20.0, -45.0);

    /// The information on the offset after 30 s of turning about one axis at 1 rad/s.
    fn information<T: Real>(axis: &Vector3<f64>) -> f64 {
        let cast = |vector: Vector3<f64>| vector.map(T::of);
        let mut sums = Sums::<T>::new();
        for window in 0..375 {
            let rotation = UnitQuaternion::from_scaled_axis(axis * (DT_S * f64::from(window)));
            sums.add(
                T::of(DT_S),
                T::of(1.0 - DT_S / 30.0),
                &FieldMeans {
                    rotation: rotation.to_rotation_matrix().matrix().map(T::of),
                    field: cast(FIELD),
                    rate: cast(axis.cross(&FIELD)),
                },
                T::ZERO,
            );
        }
        let fit = sums.fit(T::of(FIELD.norm()), Lag { mean: T::ZERO, variance: T::of(1e-4) });
        fit.expect("information is positive definite").offset_information(T::of(FIELD.norm())).as_f64()
    }

    #[test]
    fn turning_about_one_axis_tells_as_much_in_single_precision() {
        for direction in 0..200 {
            let height = (f64::from(direction) + 0.5) / 100.0 - 1.0;
            let (sin, cos) = (2.4 * f64::from(direction)).sin_cos();
            let around = (1.0 - height * height).sqrt();
            let axis = Vector3::new(around * cos, around * sin, height);
            let (single, double) = (information::<f32>(&axis), information::<f64>(&axis));
            assert!(double > 15.0, "two axes of three: {double}");
            // Of the third axis, only the prior says something, and rounding is some hundredths of that.
            assert!((single - double).abs() < 0.02 * double, "{axis:?}: {single}, in `f64` {double}");
        }
    }
}
