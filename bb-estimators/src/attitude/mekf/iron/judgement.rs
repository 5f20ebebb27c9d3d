//! When a fit replaces the offset in use, and whether the heading follows it.

use nalgebra::Vector3;

use super::sums::{Fit, Lag};
use super::{HardIron, KNOWN_HEADING};
use crate::attitude::Real;
use crate::attitude::mekf::field::FieldReference;

/// An offset is adopted if the cost falls by this multiple of the information that its three numbers fit anyway, in
/// units of its noise. The evidence of Bayes' rule asks for one (D. J. C. MacKay, "Bayesian interpolation", Neural
/// Computation 4(3), 1992, the Occam factor); the rest is for errors with longer tails than Gaussian ones.
const EVIDENCE: f64 = 2.0;

/// And by this fraction of itself.
const EVIDENCE_PART: f64 = 0.5;

/// An offset that implies another field than before needs more evidence by this factor. Disturbances are fixed in the
/// world; while they last, an offset may explain them as well, through errors that are not noise.
const OTHER_FIELD: f64 = 20.0;

/// Returning to an offset that was long in use needs less evidence.
const RETURN: f64 = 1.0 / 3.0;

/// The root mean square error of an acceptable fit, as a fraction of the norm.
const GOOD_FIT: f64 = 0.1;

/// The error of a fit that is good enough to need no other.
const BAD_FIT: f64 = 0.02;

/// The shortest time for a fit, s.
const LEAST_S: f64 = 0.5;

/// A reference seen for this long, s, is used to check whether an offset agrees with it.
const REFERENCE_S: f64 = 5.0;

/// The field of a fit may differ from the reference by this fraction of the norm.
const SAME_FIELD: f64 = 0.12;

/// A fit is an improvement if the variance of the offset is less than this fraction of the adopted one's.
const IMPROVEMENT: f64 = 0.9;

/// The heading of a field seen for this many times as long as the previous one replaces it.
const OUTLASTS: f64 = 2.0;

/// And for at least this long, s.
const OUTLASTS_S: f64 = 1.0;

/// The newly adopted offset and field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) struct Adoption<T> {
    /// The field in the world.
    pub(in super::super) field: Vector3<T>,
    /// Variance of its direction about the vertical, rad².
    pub(in super::super) variance: T,
    /// Whether this fit contains everything known about the heading.
    pub(in super::super) is_heading: bool,
    /// Whether the field differs from the reference.
    pub(in super::super) is_other_field: bool,
    /// The duration of the fit, s.
    pub(in super::super) duration: T,
}

impl<T: Real> HardIron<T> {
    /// Whether the fit is to be adopted.
    pub(super) fn judge(&mut self, fit: &Fit<T>, reference: Option<&FieldReference<T>>) -> Option<Adoption<T>> {
        let (mut cost, mut lag) = fit.cost_of(&self.offset, self.lag_before);
        let least = fit.least_cost();
        let norm = fit.field.norm();
        let within = |cost: T, part: f64| fit.mean_square(cost) < (T::of(part) * norm) * (T::of(part) * norm);
        let is_good = self.sums.duration > T::of(LEAST_S) && within(least, GOOD_FIT);
        let evidence = T::of(EVIDENCE) * fit.offset_information(self.unit) * fit.noise;
        let is_evident = |cost: T, less: T, factor: f64| {
            let gain = cost - less;
            gain > T::of(factor) * evidence && gain > T::of(EVIDENCE_PART) * cost && !within(cost, BAD_FIT)
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
            self.unknown_heading = T::ZERO;
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
