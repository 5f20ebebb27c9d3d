//! Doubt: what the estimates are off by beyond the covariance of the Kalman filter, which takes all errors for white.
//!
//! None of it changes an estimate. It makes the reported deviations honest, and the trust in the heading with them.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::field::{horizontal, in_plane};
use super::numbers::{ANY_ANGLE, CALIBRATED, GRAVITY, LONG_S, MEAN_FORCE, OUTLIER, SAME_FIELD, SHORT_S};
use crate::attitude::Real;

/// Statistics of what the filter corrects.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Doubt<T: Real> {
    /// Mean square of how far the heading is from the field, over what the filter expects, and the time it was seen for.
    surprise: T,
    seen_s: T,
    /// Tilt that accelerations have corrected of late, rad: what is not white in it is their error.
    corrected: Vector2<T>,
    /// Mean of the fields that the body has moved in, as horizontal and vertical part, and for how long, s.
    mean: Option<Vector2<T>>,
    moved_s: T,
    /// Part of the mean that the heading has followed in fields that differ from it; and the mean square of that.
    followed: Vector2<T>,
    scatter: T,
}

impl<T: Real> Doubt<T> {
    pub(super) fn new() -> Self {
        Self {
            surprise: T::ONE,
            seen_s: T::ZERO,
            corrected: Vector2::zeros(),
            mean: None,
            moved_s: T::ZERO,
            followed: Vector2::zeros(),
            scatter: T::of(CALIBRATED * CALIBRATED),
        }
    }

    /// Begins again with what the filter expects: the heading is known worse than before.
    pub(super) fn begin(&mut self) {
        self.surprise = self.surprise.max(T::ONE);
        self.seen_s = T::ZERO;
    }

    /// Forgets the mean of the fields so far, which had another offset. By how much they differ stays.
    pub(super) fn forget_mean(&mut self) {
        (self.mean, self.moved_s, self.followed) = (None, T::ZERO, Vector2::zeros());
        self.begin();
    }

    /// Adds the tilt that accelerations corrected in a window.
    pub(super) fn correct_tilt(&mut self, dt: T, corrected: Vector2<T>) {
        self.corrected += corrected - self.corrected * (dt / T::of(LONG_S)).min(T::ONE);
    }

    /// Adds a correction of the heading by the field of a window of `dt` seconds, in `moved_s` of which the body was leaving its
    /// place. In the mean of `SHORT_S` the field says that the heading is off by `missed`. `variance` is that of the heading
    /// before, `noise` that of the measured heading over a second.
    pub(super) fn correct_heading(
        &mut self,
        dt: T,
        field: &Vector3<T>,
        moved_s: T,
        missed: T,
        variance: T,
        noise: T,
    ) {
        let surprise = missed * missed / (variance + noise / T::of(2.0 * SHORT_S));
        self.seen_s = (self.seen_s + dt).min(T::of(SHORT_S * LONG_S));
        self.surprise += (surprise - self.surprise) * (dt / (self.seen_s + T::of(LONG_S)));
        let plane = in_plane(field);
        let mean = self.mean.get_or_insert(plane);
        self.moved_s = (self.moved_s + moved_s).min(T::of(SHORT_S * LONG_S));
        let off = (plane - *mean) / mean.norm();
        // A field that differs by more than an outlier counts less than half.
        let weight = T::ONE / (T::ONE + off.norm_squared() / T::of(OUTLIER * OUTLIER * SAME_FIELD * SAME_FIELD));
        *mean += (plane - *mean) * (weight * moved_s / self.moved_s.max(T::ONE));
        let gain = variance / (variance + noise / dt);
        // A field that is off by its norm tells nothing more.
        self.followed += (off / off.norm().max(T::ONE) - self.followed) * gain;
        let squared = self.followed.norm_squared();
        // A body at rest sees one place, which tells that fields are wrong here, but not that they are right.
        let seen_s = if squared > self.scatter { dt } else { moved_s };
        self.scatter += (squared - self.scatter) * (seen_s / (self.moved_s.min(T::of(LONG_S)) + T::of(SHORT_S)));
    }

    /// The covariance of the rotation error in the world, of that of the Kalman filter, with the mean specific force, what the
    /// field says the heading is off by, and the variance of the offset across the field, as a fraction of that.
    pub(super) fn covariance(
        &self,
        mut filter: Matrix3<T>,
        force: &Vector3<T>,
        missed: T,
        offset: T,
    ) -> Matrix3<T> {
        // On average a body does not fall: a mean force that is not the weight along the vertical has been turned there.
        let across = force.xy();
        let lean = Vector2::new(-across.y, across.x) * (force.z - T::of(GRAVITY))
            / (across.norm_squared() + T::of(MEAN_FORCE * MEAN_FORCE));
        let lean = lean / lean.norm().max(T::ONE);
        let tilt = lean * lean.transpose() + self.corrected * self.corrected.transpose();
        let mut block = filter.fixed_view_mut::<2, 2>(0, 0);
        block += tilt;
        let Some(mean) = self.mean else { return filter };
        let scale = self.surprise.max(T::of(1.0 / (OUTLIER * OUTLIER))).sqrt();
        for axis in 0..3 {
            filter[(2, axis)] *= scale;
            filter[(axis, 2)] *= scale;
        }
        let squared_horizontal = horizontal(mean.x, mean.norm()).powi(2);
        // The part of a field that turns the heading is not seen. In the mean it is as large as each of the two that are; beside
        // a magnet that passes, as large as both.
        let scatter = (T::HALF * self.scatter).max(self.followed.norm_squared());
        let field = (scatter + offset) * mean.norm_squared() / squared_horizontal;
        // A field that dips turns the heading with the tilt.
        let turned = T::HALF * tilt.trace() * mean.y * mean.y / squared_horizontal;
        // Either the field or the heading is off by what they differ by for seconds.
        let differs = T::HALF * missed * missed;
        filter.m33 += turned + differs + field.min(T::of(ANY_ANGLE));
        filter
    }
}
