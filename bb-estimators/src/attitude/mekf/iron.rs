//! The magnetometer's offset caused by iron on the body, estimated while the body turns, and its lag.
//!
//! A magnet on a body is a piecewise constant offset: attached, removed. It is distinguished from a disturbance of
//! the field, which is fixed in the world, by how well an offset explains the fields of several orientations; see
//! `sums.rs`.

mod judgement;
mod sums;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

pub(super) use judgement::Adoption;
pub(super) use sums::FieldMeans;
use sums::{Fit, Lag, PRIOR_OFFSET, Sums};

use super::field::FieldReference;
use crate::attitude::Real;

/// Time constant with which data fades, s: the time for which the field stays the same around a moving body.
const FADING_S: f64 = 30.0;

/// At rest all fields are equal; together they count for this long, s.
const REST_S: f64 = 0.5;

/// A system is solved every this many windows.
const WINDOWS: u32 = 4;

/// A prediction error of this fraction of the norm, root mean square, indicates another offset or another field.
const MISS: f64 = 0.07;

/// Averaging time of that error, s.
const MISS_S: f64 = 0.3;

/// An offset that was in use for this long, s, is one to return to.
const HOME_S: f64 = 20.0;

/// A heading known up to this standard deviation, rad, is worth turning to.
const KNOWN_HEADING: f64 = 0.1;

/// The offset, the lag, and the sums from which they are estimated.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct HardIron<T> {
    sums: Sums<T>,
    fit: Option<Fit<T>>,
    /// The norm of the field, in its own unit.
    unit: T,
    /// In the body frame.
    pub(super) offset: Vector3<T>,
    /// The trace of its covariance at adoption; `None` until there is evidence since the sums began.
    adopted: Option<T>,
    lag: Lag<T>,
    lag_before: Lag<T>,
    /// Mean square of the prediction errors.
    miss: T,
    windows: u32,
    /// The duration of the sums, s, without fading.
    seen_s: T,
    /// Whether the sums go back to the last time the heading was unknown.
    is_heading: bool,
    /// The duration of those sums, s.
    heading_s: T,
    /// Whether the field or the offset has changed since the start, so that the offset may be any.
    is_doubted: bool,
    home: Vector3<T>,
    held_s: T,
    /// Variance of the heading due to the uncertain offset when the sums restarted, as far as the field has not
    /// corrected the heading since, rad².
    unknown_heading: T,
    /// Mean square error of what has replaced that: of the field's heading, without a turn as uncertain after any number of
    /// measurements, rad².
    followed: T,
    /// Variance of a heading that was known and turned to another field, rad²: the previous one may have been right.
    reopened: T,
    /// The time constant with which that fades, s.
    reopened_s: T,
}

impl<T: Real> HardIron<T> {
    /// With a lag of this standard deviation, s.
    pub(super) fn new(lag_deviation: f64) -> Self {
        // A deviation of zero is one that no data moves.
        let lag = Lag { mean: T::ZERO, variance: T::of((lag_deviation * lag_deviation).max(1e-18)) };
        Self {
            sums: Sums::new(),
            fit: None,
            unit: T::ZERO,
            offset: Vector3::zeros(),
            adopted: None,
            lag,
            lag_before: lag,
            miss: T::ZERO,
            windows: 0,
            seen_s: T::ZERO,
            is_heading: true,
            heading_s: T::ZERO,
            is_doubted: false,
            home: Vector3::zeros(),
            held_s: T::ZERO,
            unknown_heading: T::ZERO,
            followed: T::ZERO,
            reopened: T::ZERO,
            reopened_s: T::ONE,
        }
    }

    /// How much the magnetometer lags the gyroscope, s.
    pub(super) fn lag(&self) -> T {
        self.lag.mean
    }

    /// Its variance, s².
    pub(super) fn lag_variance(&self) -> T {
        self.lag.variance
    }

    /// Starts the sums; `is_heading` if only they will show the heading.
    pub(super) fn begin(&mut self, is_heading: bool) {
        if self.is_heading {
            self.heading_s = self.seen_s;
        }
        self.seen_s = T::ZERO;
        self.sums = Sums::new();
        self.fit = None;
        self.adopted = None;
        self.lag_before = self.lag;
        self.miss = T::ZERO;
        self.is_heading = is_heading;
        self.is_doubted = false;
        self.held_s = T::ZERO;
        if is_heading {
            self.unknown_heading = T::ZERO;
            self.followed = T::ZERO;
            self.reopened = T::ZERO;
        }
    }

    /// A measurement of the heading replaces this fraction of its error by that of the field.
    pub(super) fn correct_heading(&mut self, fraction: T) {
        let left = (T::ONE - fraction) * (T::ONE - fraction);
        self.unknown_heading *= left;
        self.followed *= left;
        if !self.is_heading
            && let Some(fit) = &self.fit
        {
            self.followed += (T::ONE - left) * fit.squared_heading_error();
        }
    }

    /// The heading was known, and was turned to another field than one seen for this long, s: that field, too, may have been
    /// the right one, until the new one has been seen for longer.
    pub(super) fn reopen_heading(&mut self, variance: T, seen_s: T) {
        self.reopened = variance;
        self.reopened_s = seen_s.max(T::ONE);
    }

    /// The mean field in the world without the offset, if there was a field since the sums began.
    pub(super) fn mean_field(&self) -> Option<Vector3<T>> {
        self.sums.mean_field(&self.offset)
    }

    /// Rotates the world by a small rotation.
    pub(super) fn correct(&mut self, correction: &UnitQuaternion<T>) {
        self.sums.turn(correction);
    }

    /// Rotates the world by any rotation.
    pub(super) fn turn(&mut self, rotation: &UnitQuaternion<T>) {
        self.sums.turn(rotation);
        self.fit = None;
    }

    /// Rotates the world by any rotation, to the heading that the sums show.
    pub(super) fn level(&mut self, rotation: &UnitQuaternion<T>) {
        self.turn(rotation);
        self.is_heading = true;
        self.unknown_heading = T::ZERO;
        self.followed = T::ZERO;
        self.reopened = T::ZERO;
    }

    /// Covariance of the uncertainty of the offset that disturbs the heading: an offset of zero is trusted until
    /// there is a reason to doubt it.
    pub(super) fn covariance(&self) -> Matrix3<T> {
        if !self.is_doubted && self.adopted.is_none() {
            return Matrix3::zeros();
        }
        self.offset_covariance()
    }

    /// Whether there is evidence for the offset since the sums began.
    pub(super) fn is_adopted(&self) -> bool {
        self.adopted.is_some()
    }

    /// Covariance of the offset, in the field's unit squared.
    pub(super) fn offset_covariance(&self) -> Matrix3<T> {
        match &self.fit {
            Some(fit) => fit.covariance.fixed_view::<3, 3>(0, 0).into_owned(),
            None => {
                let deviation = T::of(PRIOR_OFFSET) * self.unit;
                Matrix3::identity() * (deviation * deviation)
            }
        }
    }

    /// The variance of the heading due to the uncertain offset, rad²: that of the field while it is the only source of
    /// heading, and what is left of it later.
    pub(super) fn heading_variance(&self) -> T {
        match &self.fit {
            Some(fit) if self.is_heading => fit.heading_variance(),
            _ => self.unknown_heading,
        }
    }

    /// Mean square error of the heading by all that the fields leave open, rad²: also that the fit, which is not adopted, is
    /// right, or the heading of before.
    pub(super) fn squared_heading_error(&self) -> T {
        let error = match &self.fit {
            Some(fit) if self.is_heading => fit.squared_heading_error(),
            _ => self.unknown_heading + self.followed,
        };
        error + self.reopened
    }

    /// Adds the field of a window of `dt` seconds.
    pub(super) fn observe(
        &mut self,
        dt: T,
        means: &FieldMeans<T>,
        is_at_rest: bool,
        reference: Option<&FieldReference<T>>,
        drift: T,
    ) -> Option<Adoption<T>> {
        if self.unit <= T::ZERO {
            self.unit = means.field.norm();
        }
        if self.misses(dt, means) {
            self.begin_anew();
            self.is_doubted = true;
        }
        self.held_s += dt;
        self.reopened *= T::ONE - (dt / self.reopened_s).min(T::ONE);
        self.seen_s += dt;
        if self.held_s > T::of(HOME_S) {
            self.home = self.offset;
        }
        let fading = if is_at_rest { REST_S } else { FADING_S };
        self.sums.add(dt, T::ONE - (dt / T::of(fading)).min(T::ONE), means, drift);
        self.windows += 1;
        if self.windows < WINDOWS && self.fit.is_some() {
            return None;
        }
        self.windows = 0;
        let fit = self.sums.fit(self.unit, self.lag_before)?;
        let norm = fit.field.norm();
        if !(norm + fit.noise + fit.offset_trace()).is_finite() {
            // Absurd samples overflowed the sums.
            self.begin_anew();
            return None;
        }
        self.fit = Some(fit);
        let known = T::of(KNOWN_HEADING * KNOWN_HEADING);
        if !self.is_heading && (self.unknown_heading > known || self.followed > known) {
            // By these sums alone, the heading is off by no more than this.
            let field = fit.field_of(&self.offset, self.lag.mean);
            let angle = field.x.atan2(field.y);
            let most = angle * angle + fit.heading_variance();
            if self.unknown_heading > known {
                self.unknown_heading = self.unknown_heading.min(most);
            }
            self.followed = self.followed.min(most);
        }
        if norm > T::of(0.1) * means.field.norm() {
            self.unit = norm;
        }
        self.judge(&fit, reference)
    }

    /// The body has turned unnoticed: what was seen does not go together.
    pub(super) fn forget_rotations(&mut self) {
        if self.is_heading {
            self.begin(true);
        } else {
            self.begin_anew();
        }
    }

    /// Begins again, with what is known of the heading.
    fn begin_anew(&mut self) {
        let error = self.squared_heading_error() - self.reopened;
        self.unknown_heading = self.heading_variance();
        self.followed = error - self.unknown_heading;
        self.begin(false);
    }

    /// Whether the fit predicts neither this window's field nor the previous ones.
    fn misses(&mut self, dt: T, means: &FieldMeans<T>) -> bool {
        let Some(fit) = &self.fit else { return false };
        let error = means.field - fit.field - means.rotation * fit.offset - means.rate * fit.lag;
        // The prediction's own uncertainty does not count as an error.
        let turned = means.rotation - fit.slope;
        let unknown = (turned * fit.covariance.fixed_view::<3, 3>(0, 0)).component_mul(&turned).sum();
        let excess = (error.norm_squared() - T::of(4.0) * unknown).max(T::ZERO);
        self.miss += (excess - self.miss) * (dt / T::of(MISS_S)).min(T::ONE);
        let most = T::of(MISS) * self.unit;
        self.miss > most * most
    }
}
