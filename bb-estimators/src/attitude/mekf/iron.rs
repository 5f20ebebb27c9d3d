//! The magnetometer's offset caused by iron on the body, estimated while the body turns, and its lag.
//!
//! A magnet on a body is a piecewise constant offset: attached, removed. It is distinguished from a disturbance of
//! the field, which is fixed in the world, by how well an offset explains the fields of several orientations; see
//! `sums.rs`.

mod sums;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

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

/// An offset is adopted if the cost falls by this multiple of its noise: probability e⁻¹⁵ by chance.
const EVIDENCE: f64 = 30.0;

/// And by this fraction of itself.
const EVIDENCE_PART: f64 = 0.5;

/// An offset that implies another field than before needs more evidence by this factor. Disturbances are fixed in the
/// world; while they last, an offset may explain them as well, through errors that are not noise.
const OTHER_FIELD: f64 = 20.0;

/// Returning to an offset that was long in use needs less evidence.
const RETURN: f64 = 1.0 / 3.0;

/// The time it must have been in use, s.
const HOME_S: f64 = 20.0;

/// The root mean square error of an acceptable fit, as a fraction of the norm.
const GOOD_FIT: f64 = 0.1;

/// The error of a fit that is good enough to need no other.
const BAD_FIT: f64 = 0.03;

/// The shortest time for a fit, s.
const LEAST_S: f64 = 0.5;

/// A reference seen for this long, s, is used to check whether an offset agrees with it.
const REFERENCE_S: f64 = 5.0;

/// The field of a fit may differ from the reference by this fraction of the norm.
const SAME_FIELD: f64 = 0.12;

/// A fit is an improvement if the variance of the offset is less than this fraction of the adopted one's.
const IMPROVEMENT: f64 = 0.9;

/// The heading of a field seen for this many times as long as the previous one replaces it, as in `field.rs`.
const OUTLASTS: f64 = 2.0;

/// And for at least this long, s.
const OUTLASTS_S: f64 = 1.0;

/// A heading known up to this standard deviation, rad, is worth turning to.
const KNOWN_HEADING: f64 = 0.1;

/// The newly adopted offset and field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Adoption<T> {
    /// The field in the world.
    pub(super) field: Vector3<T>,
    /// Variance of its direction about the vertical, rad².
    pub(super) variance: T,
    /// Whether this fit contains everything known about the heading.
    pub(super) is_heading: bool,
    /// Whether the field differs from the reference.
    pub(super) is_other_field: bool,
    /// The duration of the fit, s.
    pub(super) duration: T,
}

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

    /// Covariance of the uncertainty of the offset that disturbs the heading: an offset of zero is trusted until
    /// there is a reason to doubt it.
    pub(super) fn covariance(&self) -> Matrix3<T> {
        if !self.is_doubted && self.adopted.is_none() {
            return Matrix3::zeros();
        }
        self.offset_covariance()
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

    /// The variance of the heading due to the uncertain offset, rad², while the field is the only source of heading.
    pub(super) fn heading_variance(&self) -> T {
        match &self.fit {
            Some(fit) if self.is_heading => fit.heading_variance(),
            _ => T::ZERO,
        }
    }

    /// Adds the field of a window of `dt` seconds.
    pub(super) fn observe(
        &mut self,
        dt: T,
        means: &FieldMeans<T>,
        is_at_rest: bool,
        reference: Option<&FieldReference<T>>,
    ) -> Option<Adoption<T>> {
        if self.unit <= T::ZERO {
            self.unit = means.field.norm();
        }
        if self.misses(dt, means) {
            self.begin(false);
            self.is_doubted = true;
        }
        self.held_s += dt;
        self.seen_s += dt;
        if self.held_s > T::of(HOME_S) {
            self.home = self.offset;
        }
        let fading = if is_at_rest { REST_S } else { FADING_S };
        self.sums.add(dt, T::ONE - (dt / T::of(fading)).min(T::ONE), means);
        self.windows += 1;
        if self.windows < WINDOWS && self.fit.is_some() {
            return None;
        }
        self.windows = 0;
        let fit = self.sums.fit(self.unit, self.lag_before)?;
        let norm = fit.field.norm();
        if !(norm + fit.noise + fit.offset_trace()).is_finite() {
            // Absurd samples overflowed the sums.
            self.begin(false);
            return None;
        }
        self.fit = Some(fit);
        if norm > T::of(0.1) * means.field.norm() {
            self.unit = norm;
        }
        self.judge(&fit, reference)
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

    /// Whether the fit is to be adopted.
    fn judge(&mut self, fit: &Fit<T>, reference: Option<&FieldReference<T>>) -> Option<Adoption<T>> {
        let (mut cost, mut lag) = fit.cost_of(&self.offset, self.lag_before);
        let least = fit.least_cost();
        let norm = fit.field.norm();
        let within = |cost: T, part: f64| fit.mean_square(cost) < (T::of(part) * norm) * (T::of(part) * norm);
        let is_good = self.sums.duration > T::of(LEAST_S) && within(least, GOOD_FIT);
        let is_evident = |cost: T, less: T, factor: f64| {
            let gain = cost - less;
            gain > T::of(EVIDENCE * factor) * fit.noise
                && gain > T::of(EVIDENCE_PART) * cost
                && !within(cost, BAD_FIT)
        };
        let is_other_field = !self.is_heading
            && reference.is_some_and(|reference| {
                reference.seen_s() > T::of(REFERENCE_S) && !reference.is_like(&fit.field, T::of(SAME_FIELD))
            });
        let factor = if is_other_field { OTHER_FIELD } else { 1.0 };
        let mut adopted = None;
        if self.home != self.offset {
            let (at_home, lag_at_home) = fit.cost_of(&self.home, self.lag_before);
            if is_good && within(at_home, GOOD_FIT) && is_evident(cost, at_home, RETURN * factor) {
                (cost, lag) = (at_home, lag_at_home);
                adopted = Some(self.home);
            }
        }
        let trace = fit.offset_trace();
        let improves = self.adopted.is_some_and(|before| trace < T::of(IMPROVEMENT) * before);
        if is_good && (improves || is_evident(cost, least, factor)) {
            lag = fit.lag;
            adopted = Some(fit.offset);
        }
        self.lag = Lag { mean: lag, variance: fit.covariance[(3, 3)] };
        let outlasts = !self.is_heading
            && is_good
            && self.seen_s > T::of(OUTLASTS_S) + T::of(OUTLASTS) * self.heading_s
            && fit.heading_variance() < T::of(KNOWN_HEADING * KNOWN_HEADING);
        if outlasts {
            self.is_heading = true;
        } else if adopted.is_none() {
            return None;
        }
        if let Some(offset) = adopted {
            self.offset = offset;
            self.adopted = Some(trace);
            if !improves {
                self.held_s = T::ZERO;
            }
        }
        Some(Adoption {
            field: fit.field_of(&self.offset, lag),
            variance: fit.heading_variance(),
            is_heading: self.is_heading,
            is_other_field,
            duration: self.sums.duration,
        })
    }
}
