//! Reference field where the body was, and its distance from the present one.

use nalgebra::{Vector2, Vector3};

use super::numbers::{BRIEF_S, CALIBRATED, DISTURBANCE, HEADING_NOISE, LONG_S, NEW_FIELD_S, SAME_FIELD, SHORT_S};
use crate::attitude::Real;

/// The reference, as horizontal and vertical part.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Field<T: Real> {
    reference: Vector2<T>,
    /// Time for which the body has moved in it, s.
    seen_s: T,
    /// Another field, and how long the body has moved in that.
    candidate: Vector2<T>,
    lasted_s: T,
    /// Squared distance from the reference, as a fraction of its norm: the largest of late.
    disturbance: T,
    /// Present distance from the reference, as a fraction of its norm; how far the filter has followed such distances, with the
    /// gain of its heading; and the mean square of that.
    off: Vector2<T>,
    followed: Vector2<T>,
    scatter: T,
}

/// Evidence of a window on the heading.
pub(super) struct Verdict<T> {
    /// Variance of the measured heading over a second, rad² s.
    pub(super) noise: T,
    /// True if the reference is another one than before.
    pub(super) is_new: bool,
}

impl<T: Real> Field<T> {
    pub(super) fn new(field: &Vector3<T>) -> Self {
        let plane = in_plane(field);
        Self {
            reference: plane,
            seen_s: T::ZERO,
            candidate: plane,
            lasted_s: T::ZERO,
            disturbance: T::ZERO,
            off: Vector2::zeros(),
            followed: Vector2::zeros(),
            scatter: T::of(CALIBRATED * CALIBRATED),
        }
    }

    pub(super) fn horizontal(&self) -> T {
        self.reference.x
    }

    /// The vertical part over the horizontal one.
    pub(super) fn dip(&self) -> T {
        self.reference.y / self.effective_horizontal()
    }

    fn effective_horizontal(&self) -> T {
        self.reference.x.max(T::of(LEAST_HORIZONTAL) * self.reference.norm())
    }

    /// Variance of the heading by what is wrong in the field for long, rad², with the expected square of an offset's part.
    /// The part across the field, which turns the heading, is not seen, but as large as each of the two that are.
    pub(super) fn variance(&self, offset: T) -> T {
        (T::HALF * self.scatter + offset) * self.reference.norm_squared() / self.effective_horizontal().powi(2)
    }

    /// Adds that the heading was corrected towards the field by this part of what was missing.
    pub(super) fn follow(&mut self, gain: T, dt: T, moved_s: T) {
        self.followed += (self.off - self.followed) * gain;
        let squared = self.followed.norm_squared();
        // A body at rest sees one place, which tells that fields are wrong here, but not that they are right.
        let seen_s = if squared > self.scatter { dt } else { moved_s };
        self.scatter += (squared - self.scatter) * (seen_s / (self.seen_s.min(T::of(LONG_S)) + T::of(SHORT_S)));
    }

    pub(super) fn is_disturbed(&self) -> bool {
        self.disturbance > T::of(SAME_FIELD * SAME_FIELD)
    }

    /// Adds the mean field of a window of `dt` seconds, in `moved_s` of which the body was leaving its place.
    pub(super) fn observe(&mut self, dt: T, field: &Vector3<T>, moved_s: T) -> Verdict<T> {
        let plane = in_plane(field);
        let same = T::of(SAME_FIELD * SAME_FIELD);
        let mut squared = (plane - self.reference).norm_squared() / self.reference.norm_squared();
        let mut is_calm = squared < same;
        if (plane - self.candidate).norm_squared() < same * self.candidate.norm_squared() {
            self.lasted_s += moved_s;
        } else {
            self.lasted_s = T::ZERO;
            self.candidate = plane;
        }
        self.candidate += (plane - self.candidate) * (dt / T::of(NEW_FIELD_S)).min(T::ONE);
        let is_new = !is_calm && self.lasted_s > (T::of(SHORT_S) + T::TWO * self.seen_s).min(T::of(LONG_S));
        if is_new {
            self.reference = self.candidate;
            self.seen_s = self.lasted_s;
            self.disturbance = T::ZERO;
            is_calm = true;
        }
        if is_calm {
            self.seen_s += moved_s;
            let memory = self.seen_s.max(T::ONE).min(T::of(LONG_S)).max(dt);
            self.reference += (plane - self.reference) * (dt / memory);
        }
        // A field that is off by its norm tells nothing more.
        squared = squared.min(T::ONE);
        let off = (plane - self.reference) / self.reference.norm();
        self.off = off / off.norm().max(T::ONE);
        let faded = self.disturbance + (squared - self.disturbance) * (dt / T::of(BRIEF_S)).min(T::ONE);
        self.disturbance = squared.max(faded);
        let known_s = self.seen_s + T::of(0.1);
        let squared_norm = field.norm_squared();
        let slope = squared_norm / effective_horizontal(field).powi(2);
        let noise = T::of(HEADING_NOISE * HEADING_NOISE)
            + T::of(DISTURBANCE * DISTURBANCE) * self.disturbance * slope * known_s / (known_s + T::of(SHORT_S));
        Verdict { noise, is_new }
    }
}

/// The least part of a field that counts as horizontal.
const LEAST_HORIZONTAL: f64 = 0.05;

/// The horizontal part of a field, but at least a twentieth of it.
pub(super) fn effective_horizontal<T: Real>(field: &Vector3<T>) -> T {
    field.xy().norm().max(T::of(LEAST_HORIZONTAL) * field.norm())
}

fn in_plane<T: Real>(field: &Vector3<T>) -> Vector2<T> {
    Vector2::new(field.xy().norm(), field.z)
}
