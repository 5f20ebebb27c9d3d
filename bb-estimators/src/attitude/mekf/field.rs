//! The expected magnetic field, and its reliability.
//!
//! Only two of three components of a field disturbance are observable: the one along the field and the one that
//! changes the dip. The third, which turns the heading, cannot be distinguished from a wrong heading. But all three
//! have similar sizes, so the two that are observable show how wrong the heading may be.

use nalgebra::Vector3;

use crate::attitude::Real;
use crate::attitude::initial::MIN_HORIZONTAL_FRACTION;

/// Norm and dip count as unchanged up to this difference of the field in the vertical plane, as a fraction of its
/// norm. Source: VQF's `magNormTh` of 0.1 and `magDipTh` of 10° in one.
const SAME: f64 = 0.1;

/// A field further from the reference than this many times that, squared, is that of iron and says nothing about a drift.
const NEARBY: f64 = 4.0;

/// A changed field nearer than that is iron that the body passes, for up to this time, s, and part of a drift from then on.
const PASSING_S: f64 = 6.0;

/// Time constant of the mean over a field that may become the reference, s. VQF's `magCurrentTau` is 0.05 s, with an
/// additional wait of 20 s; here, mean and wait are one.
const CANDIDATE_TIME_CONSTANT_S: f64 = 5.0;

/// The reference is the mean of this many seconds of undisturbed field, and is trusted in full after them when it says that a
/// field is disturbed. Source: VQF's `magRefTau`.
const REFERENCE_TIME_CONSTANT_S: f64 = 20.0;

/// The shortest time before a new field is accepted, s.
const LEAST_EVIDENCE_S: f64 = 1.0;

/// A new field is accepted after this many times the duration of the reference: neither is known to be the undisturbed
/// one, so the longer one is.
const EVIDENCE_RATIO: f64 = 1.0;

/// A new field that lasts this long is accepted in any case, s.
const MOST_EVIDENCE_S: f64 = 40.0;

/// How soon a disturbance is forgotten, s: passing a piece of iron takes about a second.
const DISTURBANCE_TIME_CONSTANT_S: f64 = 3.0;

/// A reference seen this long, s, is trusted in full when another field may be due to iron on the body: before, the heading of
/// the reference is in as much doubt.
const OFFSET_DOUBTED_S: f64 = 8.0;

/// A heading that contradicts an undisturbed field for this long, s, is wrong.
const CONTRADICTION_S: f64 = 10.0;

/// Changes of the field over more than this time, s, are a drift: that of a candidate. So a drift lasts at least as long.
const SLOW_S: f64 = CANDIDATE_TIME_CONSTANT_S;

/// How soon the size of a drift is forgotten, s: longer than the drifts that the heading follows take.
const DRIFT_TIME_CONSTANT_S: f64 = 60.0;

/// A drift is one from the mean of this many seconds: much longer than a drift takes, but a change that lasts becomes
/// the usual field, however long the filter has run.
const DRIFT_MEAN_S: f64 = 5.0 * DRIFT_TIME_CONSTANT_S;

/// A larger deviation from the reference, as a multiple of it, makes no difference.
const LARGEST: f64 = 10.0;

/// The field in the vertical plane: horizontal and vertical part.
pub(super) type Plane<T> = [T; 2];

/// The consequence of a window's field for the heading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict<T> {
    /// Reliable up to a disturbance with this variance of each component, as a fraction of the norm squared.
    Disturbed(T),
    /// There is a new reference, or the heading must be wrong: it may be off by the full difference from the field.
    HeadingUnknown,
}

/// How the field drifts more slowly than a body passes a disturbance.
///
/// The heading follows such a drift, and its variance as computed from disturbances of a second does not include it. As
/// with these, the component that turns the heading is assumed to be as large as the two visible ones are on average.
#[derive(Clone, Debug, PartialEq)]
struct Drift<T> {
    slow: Plane<T>,
    mean: Plane<T>,
    /// Squared distance between the two: the largest of late.
    squared: T,
    /// The time averaged over, s.
    duration: T,
}

impl<T: Real> Drift<T> {
    fn new(field: Plane<T>) -> Self {
        Self { slow: field, mean: field, squared: T::ZERO, duration: T::ZERO }
    }

    /// Adds the field of a window of `dt` seconds.
    fn add(&mut self, dt: T, field: Plane<T>) {
        self.duration = (self.duration + dt).min(T::of(DRIFT_MEAN_S));
        approach(&mut self.slow, field, dt / self.duration.min(T::of(SLOW_S)));
        // Until a first mean exists, the start is not part of a drift: the tilt may still be wrong.
        let gain = if self.duration < T::of(SLOW_S) { T::ONE } else { dt / self.duration };
        approach(&mut self.mean, self.slow, gain);
        let squared = distance(self.slow, self.mean);
        let fade = (dt / T::of(DRIFT_TIME_CONSTANT_S)).min(T::ONE);
        self.squared = (self.squared + (squared - self.squared) * fade).max(squared);
    }

    /// Variance of one component.
    fn variance(&self) -> T {
        T::HALF * self.squared
    }
}

/// The reference, and the field that may become the next one.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FieldReference<T> {
    reference: Plane<T>,
    /// How long the field has agreed with the reference, s.
    seen_s: T,
    candidate: Plane<T>,
    candidate_s: T,
    /// Squared size of the disturbance: the largest recent one.
    disturbance: T,
    contradicted_s: T,
    /// How long the field has differed from the reference, s.
    changed_s: T,
    drift: Drift<T>,
}

impl<T: Real> FieldReference<T> {
    /// Sets the first field as reference; it is not zero.
    pub(super) fn new(field: Plane<T>) -> Self {
        Self {
            reference: field,
            seen_s: T::ZERO,
            candidate: field,
            candidate_s: T::ZERO,
            disturbance: T::ZERO,
            contradicted_s: T::ZERO,
            changed_s: T::ZERO,
            drift: Drift::new(field),
        }
    }

    /// A reference that has been seen for this long, s.
    pub(super) fn seen(field: Plane<T>, seen_s: T) -> Self {
        Self { seen_s: seen_s.min(T::of(MOST_EVIDENCE_S)), ..Self::new(field) }
    }

    /// How long the field has agreed with the reference, s.
    pub(super) fn seen_s(&self) -> T {
        self.seen_s
    }

    /// Whether a field in the world has the norm and dip of the reference, up to a fraction of its norm.
    pub(super) fn is_like(&self, field: &Vector3<T>, part: T) -> bool {
        distance(in_plane(field), self.reference) < (part * self.norm()) * (part * self.norm())
    }

    /// Variance of the heading by the field's drift, rad².
    pub(super) fn drift_variance(&self) -> T {
        let horizontal = self.horizontal();
        self.drift.variance() / (self.squared_norm() * horizontal * horizontal)
    }

    /// The spectral density of one component of the drift, an error that lasts, as a fraction of the norm squared, s.
    pub(super) fn lasting_drift(&self) -> T {
        T::TWO * T::of(SLOW_S) * self.drift.variance() / self.squared_norm()
    }

    /// How far an unknown offset of the magnetometer is held against another field than the reference, up to 1.
    pub(super) fn offset_doubt(&self) -> T {
        (self.seen_s * T::of(1.0 / OFFSET_DOUBTED_S)).min(T::ONE)
    }

    fn norm(&self) -> T {
        norm(self.reference)
    }

    /// Whether the largest recent disturbance exceeds the limit for an unchanged field.
    pub(super) fn is_disturbed(&self) -> bool {
        self.disturbance > T::of(SAME * SAME)
    }

    /// In the field's own unit, squared.
    pub(super) fn squared_norm(&self) -> T {
        self.norm() * self.norm()
    }

    /// Horizontal part of the reference, as a fraction of its norm.
    pub(super) fn horizontal(&self) -> T {
        (self.reference[0] / self.norm()).max(T::of(MIN_HORIZONTAL_FRACTION))
    }

    /// Vertical part, upwards, as a fraction.
    pub(super) fn vertical(&self) -> T {
        self.reference[1] / self.norm()
    }

    /// Adds the field of a window of `dt` seconds; `contradicts` if its heading is far from the known one.
    pub(super) fn observe(&mut self, dt: T, field: Plane<T>, contradicts: bool) -> Verdict<T> {
        let unit = self.norm();
        let same = (T::of(SAME) * unit) * (T::of(SAME) * unit);
        let field = shortened(field, T::of(LARGEST) * unit);

        if distance(field, self.candidate) < same {
            self.candidate_s += dt;
            // Only while alike: the age is that of the field that the candidate is the mean of.
            approach(&mut self.candidate, field, (dt / T::of(CANDIDATE_TIME_CONSTANT_S)).min(T::ONE));
        } else {
            self.candidate_s -= T::of(3.0) * dt;
        }
        if self.candidate_s <= T::ZERO {
            self.candidate_s = T::ZERO;
            self.candidate = field;
        }
        if distance(self.candidate, self.reference) < same {
            // The reference itself; its age says nothing about the next field.
            self.candidate_s = self.candidate_s.min(T::of(LEAST_EVIDENCE_S));
        }

        let difference = distance(field, self.reference);
        let undisturbed = difference < same;
        self.changed_s = if undisturbed { T::ZERO } else { (self.changed_s + dt).min(T::of(PASSING_S)) };
        // Iron that is passed is no drift: the filter hardly follows it.
        if undisturbed || (difference < T::of(NEARBY) * same && self.changed_s >= T::of(PASSING_S)) {
            self.drift.add(dt, field);
        }
        if undisturbed {
            self.seen_s = (self.seen_s + dt).min(T::of(MOST_EVIDENCE_S));
        }
        let needed = (T::of(LEAST_EVIDENCE_S) + T::of(EVIDENCE_RATIO) * self.seen_s).min(T::of(MOST_EVIDENCE_S));
        if distance(self.candidate, self.reference) > same && self.candidate_s > needed {
            *self = Self { seen_s: self.candidate_s, ..Self::new(self.candidate) };
            return Verdict::HeadingUnknown;
        }
        self.contradicted_s = if undisturbed && contradicts { self.contradicted_s + dt } else { T::ZERO };
        if self.contradicted_s > T::of(CONTRADICTION_S) {
            self.contradicted_s = T::ZERO;
            return Verdict::HeadingUnknown;
        }

        let size = distance(field, self.reference) / (unit * unit);
        let fade = (dt / T::of(DISTURBANCE_TIME_CONSTANT_S)).min(T::ONE);
        self.disturbance = (self.disturbance + (size - self.disturbance) * fade).max(size);
        let trust = (self.seen_s * T::of(1.0 / REFERENCE_TIME_CONSTANT_S)).min(T::ONE);
        let verdict = Verdict::Disturbed(self.disturbance * trust);
        if undisturbed {
            let gain = dt / self.seen_s.min(T::of(REFERENCE_TIME_CONSTANT_S)).max(dt);
            approach(&mut self.reference, field, gain);
        }
        verdict
    }
}

/// Horizontal and vertical part of a field in the world.
pub(super) fn in_plane<T: Real>(field: &Vector3<T>) -> Plane<T> {
    [(field.x * field.x + field.y * field.y).sqrt(), field.z]
}

fn norm<T: Real>([horizontal, vertical]: Plane<T>) -> T {
    (horizontal * horizontal + vertical * vertical).sqrt()
}

fn distance<T: Real>(a: Plane<T>, b: Plane<T>) -> T {
    (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1])
}

fn approach<T: Real>(mean: &mut Plane<T>, value: Plane<T>, gain: T) {
    for (mean, value) in mean.iter_mut().zip(value) {
        *mean += (value - *mean) * gain;
    }
}

fn shortened<T: Real>(field: Plane<T>, longest: T) -> Plane<T> {
    let norm = norm(field);
    if norm > longest { field.map(|part| part * (longest / norm)) } else { field }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;

    const WINDOW_S: f64 = 0.03;

    /// How long a field lasts before it makes the heading unknown, s; `None` if it does not within `most_s`.
    fn believed_after(reference: &mut FieldReference<f64>, field: Plane<f64>, most_s: f64) -> Option<f64> {
        let windows = (most_s / WINDOW_S) as i32;
        (1..=windows)
            .find(|_| reference.observe(WINDOW_S, field, false) == Verdict::HeadingUnknown)
            .map(|window| f64::from(window) * WINDOW_S)
    }

    /// Standard deviation of the heading by the drift, degrees: the most, and half an hour after a step of the field that
    /// comes after hours.
    fn after_a_step<T: Real>(hours: i32) -> [f64; 2] {
        let window_s = T::of(0.08);
        let mut reference = FieldReference::new([T::of(20.0), T::of(-45.0)]);
        for _ in 0..hours * 45_000 {
            reference.observe(window_s, [T::of(20.0), T::of(-45.0)], false);
        }
        let mut deviation = || {
            assert_ne!(reference.observe(window_s, [T::of(24.6), T::of(-45.0)], false), Verdict::HeadingUnknown);
            reference.drift_variance().as_f64().sqrt().to_degrees()
        };
        let deviations: Vec<_> = (0..22_500).map(|_| deviation()).collect();
        [deviations.iter().copied().fold(0.0, f64::max), deviations[deviations.len() - 1]]
    }

    #[test]
    fn a_lasting_change_becomes_the_usual_field_however_long_it_has_run() {
        for hours in [1, 10, 30] {
            for [most, left] in [after_a_step::<f64>(hours), after_a_step::<f32>(hours)] {
                assert!(most > 5.0, "the heading may have followed it: {most}");
                assert!(left < 0.5, "{left} after {hours} h");
            }
        }
    }

    #[test]
    fn an_offset_is_doubted_as_long_as_the_reference_was_seen() {
        let mut reference = FieldReference::new([20.0, -45.0]);
        assert_eq!(reference.offset_doubt(), 0.0, "the first field may be the one of iron as well");
        believed_after(&mut reference, [20.0, -45.0], 0.5 * OFFSET_DOUBTED_S);
        assert!((reference.offset_doubt() - 0.5).abs() < 0.01, "{}", reference.offset_doubt());
        believed_after(&mut reference, [30.0, -45.0], 2.0);
        assert!((reference.offset_doubt() - 0.5).abs() < 0.01, "another field says nothing about the reference");
        believed_after(&mut reference, [20.0, -45.0], 2.0 * OFFSET_DOUBTED_S);
        assert_eq!(reference.offset_doubt(), 1.0);
    }

    #[test]
    fn a_new_field_needs_evidence_of_its_own() {
        for steady_s in [1.0, 5.0, 40.0, 300.0] {
            for jump in [0.12, 0.3, 1.0] {
                let mut reference = FieldReference::new([20.0, -45.0]);
                assert_eq!(believed_after(&mut reference, [20.0, -45.0], steady_s), None);
                let needed = (LEAST_EVIDENCE_S + EVIDENCE_RATIO * steady_s).min(MOST_EVIDENCE_S);
                let believed = believed_after(&mut reference, [20.0 + 49.0 * jump, -45.0], 100.0);
                let believed = believed.expect("a field that lasts is believed");
                assert!(believed > 0.9 * needed && believed < needed + 5.0, "{steady_s} s, {jump}: {believed} s");
            }
        }
    }
}
