//! Reference field where the body was, and its distance from the present one.

use nalgebra::{Vector2, Vector3};

use super::numbers::{BRIEF_S, DISTURBANCE, HEADING_NOISE, LONG_S, SAME_FIELD, SHORT_S};
use crate::attitude::Real;

/// The reference, as horizontal and vertical part.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Field<T: Real> {
    reference: Vector2<T>,
    /// Time for which the body has moved in it, s.
    seen_s: T,
    /// Squared distance from the reference, as a fraction of its norm: the largest of late.
    disturbance: T,
}

impl<T: Real> Field<T> {
    pub(super) fn new(field: &Vector3<T>) -> Self {
        let plane = in_plane(field);
        Self { reference: plane, seen_s: T::ZERO, disturbance: T::ZERO }
    }

    pub(super) fn horizontal(&self) -> T {
        self.reference.x
    }

    pub(super) fn is_disturbed(&self) -> bool {
        self.disturbance > T::of(SAME_FIELD * SAME_FIELD)
    }

    /// Adds the mean field of a window of `dt` seconds, in `moved_s` of which the body was leaving its place. Returns the variance
    /// of the heading that it shows over a second, rad² s.
    pub(super) fn observe(&mut self, dt: T, field: &Vector3<T>, moved_s: T) -> T {
        let plane = in_plane(field);
        // A field that is off by its norm tells nothing more.
        let squared = ((plane - self.reference).norm_squared() / self.reference.norm_squared()).min(T::ONE);
        // Another field hardly counts, but becomes the reference in the end if it lasts.
        let ratio = squared / T::of(SAME_FIELD * SAME_FIELD);
        let weight = T::ONE / (T::ONE + ratio * ratio);
        self.seen_s += moved_s * weight;
        let memory = self.seen_s.max(T::ONE).min(T::of(LONG_S)).max(dt);
        self.reference += (plane - self.reference) * (dt * weight / memory);
        let faded = self.disturbance + (squared - self.disturbance) * (dt / T::of(BRIEF_S)).min(T::ONE);
        self.disturbance = squared.max(faded);
        let known_s = self.seen_s + T::of(0.1);
        let slope = field.norm_squared() / effective_horizontal(field).powi(2);
        T::of(HEADING_NOISE * HEADING_NOISE)
            + T::of(DISTURBANCE * DISTURBANCE) * self.disturbance * slope * known_s / (known_s + T::of(SHORT_S))
    }
}

/// The least part of a field that counts as horizontal.
const LEAST_HORIZONTAL: f64 = 0.05;

/// The horizontal part of a field, but at least a twentieth of its norm.
pub(super) fn horizontal<T: Real>(horizontal: T, norm: T) -> T {
    horizontal.max(T::of(LEAST_HORIZONTAL) * norm)
}

pub(super) fn effective_horizontal<T: Real>(field: &Vector3<T>) -> T {
    horizontal(field.xy().norm(), field.norm())
}

/// The horizontal and the vertical part of a field.
pub(super) fn in_plane<T: Real>(field: &Vector3<T>) -> Vector2<T> {
    Vector2::new(field.xy().norm(), field.z)
}
