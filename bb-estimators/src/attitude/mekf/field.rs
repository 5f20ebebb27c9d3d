//! What the magnetic field is expected to be, and how far it can be believed.
//!
//! Of a disturbance of the field only two of three components show: the one along the field and the one that
//! changes the dip. The third, which turns the heading, cannot be told from a wrong heading. But all three are
//! of one size, so the two that show tell how wrong the heading may be.

/// Norm and dip count as unchanged up to this difference of the field in the vertical plane, as a fraction of its
/// norm. Source: VQF's `magNormTh` of 0.1 and `magDipTh` of 10° in one.
const SAME: f64 = 0.1;

/// Time constant of the mean over a field that may become the reference, s. Source: VQF's `magCurrentTau` is
/// 0.05 s, to which it adds a wait of 20 s; here mean and wait are one.
const CANDIDATE_TIME_CONSTANT_S: f64 = 5.0;

/// The reference is the mean of the last so many seconds of undisturbed field. Source: VQF's `magRefTau`.
const REFERENCE_TIME_CONSTANT_S: f64 = 20.0;

/// A new field is believed no sooner than this, s.
const LEAST_EVIDENCE_S: f64 = 1.0;

/// A new field is believed when it has lasted this many times as long as the reference was seen.
const EVIDENCE_RATIO: f64 = 2.0;

/// A new field that lasts this long is believed whatever was before, s.
const MOST_EVIDENCE_S: f64 = 40.0;

/// How soon a disturbance is forgotten, s: passing a piece of iron takes about a second.
const DISTURBANCE_TIME_CONSTANT_S: f64 = 3.0;

/// A reference seen this long, s, is believed by half when it says that a field is disturbed.
const TRUST_TIME_CONSTANT_S: f64 = 10.0;

/// A heading that contradicts an undisturbed field all of this time is wrong, s.
const CONTRADICTION_S: f64 = 10.0;

/// A field this far beyond the reference, as a multiple of it, is as good as one farther.
const LARGEST: f64 = 10.0;

/// The field in the vertical plane: horizontal and vertical part.
type Plane = [f64; 2];

/// What a window's field means for the heading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    /// To be believed but for a disturbance of this variance of each component, as fractions of the norm squared.
    Disturbed(f64),
    /// There is a new reference, or the heading must be wrong: it can be off by all that the field says.
    HeadingUnknown,
}

/// The reference, and the field that may become the next one.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FieldReference {
    reference: Plane,
    /// How long the field has been like the reference, s.
    seen_s: f64,
    candidate: Plane,
    candidate_s: f64,
    /// Squared size of the disturbance: the greatest of late.
    disturbance: f64,
    contradicted_s: f64,
}

impl FieldReference {
    /// Takes the first field as reference; it is not zero.
    pub(super) fn new(field: Plane) -> Self {
        Self {
            reference: field,
            seen_s: 0.0,
            candidate: field,
            candidate_s: 0.0,
            disturbance: 0.0,
            contradicted_s: 0.0,
        }
    }

    fn norm(&self) -> f64 {
        norm(self.reference)
    }

    /// Whether the greatest disturbance of late is beyond what counts as unchanged.
    pub(super) fn is_disturbed(&self) -> bool {
        self.disturbance > SAME * SAME
    }

    /// In the field's own unit, squared.
    pub(super) fn squared_norm(&self) -> f64 {
        self.norm() * self.norm()
    }

    /// Horizontal part of the reference, as a fraction of its norm.
    pub(super) fn horizontal(&self) -> f64 {
        (self.reference[0] / self.norm()).max(crate::attitude::initial::MIN_HORIZONTAL_FRACTION)
    }

    /// Vertical part, upwards, as a fraction.
    pub(super) fn vertical(&self) -> f64 {
        self.reference[1] / self.norm()
    }

    /// Takes the field of a window of `dt` seconds; `contradicts` if its heading is far from the one known.
    pub(super) fn observe(&mut self, dt: f64, field: Plane, contradicts: bool) -> Verdict {
        let unit = self.norm();
        let same = (SAME * unit) * (SAME * unit);
        let field = shortened(field, LARGEST * unit);

        if distance(field, self.candidate) < same {
            self.candidate_s += dt;
        } else {
            self.candidate_s -= 3.0 * dt;
        }
        if self.candidate_s <= 0.0 {
            self.candidate_s = 0.0;
            self.candidate = field;
        }
        approach(&mut self.candidate, field, (dt / CANDIDATE_TIME_CONSTANT_S).min(1.0));

        let undisturbed = distance(field, self.reference) < same;
        if undisturbed {
            self.seen_s = (self.seen_s + dt).min(MOST_EVIDENCE_S);
        }
        let needed = (LEAST_EVIDENCE_S + EVIDENCE_RATIO * self.seen_s).min(MOST_EVIDENCE_S);
        if distance(self.candidate, self.reference) > same && self.candidate_s > needed {
            *self = Self { seen_s: self.candidate_s, ..Self::new(self.candidate) };
            return Verdict::HeadingUnknown;
        }
        self.contradicted_s = if undisturbed && contradicts { self.contradicted_s + dt } else { 0.0 };
        if self.contradicted_s > CONTRADICTION_S {
            self.contradicted_s = 0.0;
            return Verdict::HeadingUnknown;
        }

        let size = distance(field, self.reference) / (unit * unit);
        let fade = (dt / DISTURBANCE_TIME_CONSTANT_S).min(1.0);
        self.disturbance = (self.disturbance + (size - self.disturbance) * fade).max(size);
        let trust = self.seen_s / (self.seen_s + TRUST_TIME_CONSTANT_S);
        let verdict = Verdict::Disturbed(self.disturbance * trust);
        if undisturbed {
            let gain = dt / self.seen_s.min(REFERENCE_TIME_CONSTANT_S).max(dt);
            approach(&mut self.reference, field, gain);
        }
        verdict
    }
}

fn norm([horizontal, vertical]: Plane) -> f64 {
    (horizontal * horizontal + vertical * vertical).sqrt()
}

fn distance(a: Plane, b: Plane) -> f64 {
    (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1])
}

fn approach(mean: &mut Plane, value: Plane, gain: f64) {
    for (mean, value) in mean.iter_mut().zip(value) {
        *mean += (value - *mean) * gain;
    }
}

fn shortened(field: Plane, longest: f64) -> Plane {
    let norm = norm(field);
    if norm > longest { field.map(|part| part * (longest / norm)) } else { field }
}
