//! Doubt: what the estimates are off by beyond the covariance of the Kalman filter, which takes all errors for white.
//!
//! None of it changes an estimate. It makes the reported deviations honest, and the trust in the heading with them.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::field::Field;
use super::numbers::{ANY_ANGLE, GRAVITY, LONG_S, MEAN_FORCE, OUTLIER, SHORT_S};
use super::offset::HardIron;
use crate::attitude::Real;

/// Statistics of what the filter corrects.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Doubt<T: Real> {
    /// Mean square of how far the heading is from the field, over what the filter expects, and the time it was seen for.
    surprise: T,
    seen_s: T,
    /// Tilt that accelerations have corrected of late, rad: what is not white in it is their error.
    corrected: Vector2<T>,
}

impl<T: Real> Doubt<T> {
    pub(super) fn new() -> Self {
        Self { surprise: T::ONE, seen_s: T::ZERO, corrected: Vector2::zeros() }
    }

    /// Begins again with what the filter expects: the heading is known worse than before.
    pub(super) fn begin(&mut self) {
        self.surprise = self.surprise.max(T::ONE);
        self.seen_s = T::ZERO;
    }

    /// Adds the tilt that accelerations corrected in a window.
    pub(super) fn correct_tilt(&mut self, dt: T, corrected: Vector2<T>) {
        self.corrected += corrected - self.corrected * (dt / T::of(LONG_S)).min(T::ONE);
    }

    /// Adds how far the field says that the heading is off, in the mean of `SHORT_S`, for a heading of this variance and a
    /// field of this noise over a second.
    pub(super) fn miss_heading(&mut self, dt: T, missed: T, variance: T, noise: T) {
        let surprise = missed * missed / (variance + noise / T::of(2.0 * SHORT_S));
        self.seen_s = (self.seen_s + dt).min(T::of(SHORT_S * LONG_S));
        self.surprise += (surprise - self.surprise) * (dt / (self.seen_s + T::of(LONG_S)));
    }

    /// The covariance of the rotation error in the world, of that of the Kalman filter.
    pub(super) fn covariance(
        &self,
        mut filter: Matrix3<T>,
        force: &Vector3<T>,
        field: Option<&Field<T>>,
        iron: &HardIron<T>,
    ) -> Matrix3<T> {
        // On average a body does not fall: a mean force that is not the weight along the vertical has been turned there.
        let across = force.xy();
        let lean = Vector2::new(-across.y, across.x) * (force.z - T::of(GRAVITY))
            / (across.norm_squared() + T::of(MEAN_FORCE * MEAN_FORCE));
        let lean = lean / lean.norm().max(T::ONE);
        let tilt = lean * lean.transpose() + self.corrected * self.corrected.transpose();
        let mut block = filter.fixed_view_mut::<2, 2>(0, 0);
        block += tilt;
        let Some(field) = field else { return filter };
        let scale = self.surprise.max(T::of(1.0 / (OUTLIER * OUTLIER))).sqrt();
        for axis in 0..3 {
            filter[(2, axis)] *= scale;
            filter[(axis, 2)] *= scale;
        }
        // A field that dips turns the heading with the tilt.
        let turned = T::HALF * lean.norm_squared() * field.dip().powi(2);
        filter.m33 += turned + field.variance(iron.doubt()).min(T::of(ANY_ANGLE));
        filter
    }
}
