//! The heading: an angle about the vertical that follows the field's. Section 3.3 of the paper.

use nalgebra::{UnitQuaternion, Vector3};

use super::coefficients::FieldCoefficients;
use crate::attitude::Real;
use crate::attitude::initial::heading_error;
use crate::attitude::rotation::{half_angle, turn_heading_by};

/// The rotation about the vertical from the level frame to the world.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Heading<T> {
    /// Cosine and sine of half the angle.
    half: [T; 2],
    /// The gain of a mean over all fields so far, while it is above that of the low-pass; then 0.
    mean_gain: T,
}

impl<T: Real> Heading<T> {
    /// Unknown; the next field sets it if `mean_gain` is 1. If `mean_gain` is 0, it is known.
    pub(super) fn new(mean_gain: T) -> Self {
        Self { half: [T::ONE, T::ZERO], mean_gain }
    }

    #[inline]
    pub(super) fn world_from(&self, level_from_body: &UnitQuaternion<T>) -> UnitQuaternion<T> {
        turn_heading_by(level_from_body, self.half)
    }

    /// Adds the direction of a field in the level frame, with weight `trust`, a fraction.
    #[inline]
    pub(super) fn correct(
        &mut self,
        dt_s: T,
        time_constant_s: T,
        coefficients: &FieldCoefficients<T>,
        field: &Vector3<T>,
        trust: T,
    ) {
        let gain = (coefficients.heading_gain * trust).max(self.mean_gain);
        if gain <= T::ZERO {
            return;
        }
        let [cos, sin] = self.half;
        let (full_cos, full_sin) = (cos * cos - sin * sin, T::TWO * cos * sin);
        let (x, y) = (full_cos * field.x - full_sin * field.y, full_sin * field.x + full_cos * field.y);
        let Some(error) = heading_error(&Vector3::new(x, y, field.z)) else {
            return;
        };
        if self.mean_gain > T::ZERO {
            self.mean_gain /= T::ONE + self.mean_gain;
            if self.mean_gain * time_constant_s < dt_s {
                self.mean_gain = T::ZERO;
            }
        }
        let angle = gain * error;
        let (turn_cos, scale) = half_angle(angle * angle);
        let turn_sin = scale * angle;
        let [cos, sin] = [cos * turn_cos - sin * turn_sin, sin * turn_cos + cos * turn_sin];
        let norm = T::of(1.5) - T::HALF * (cos * cos + sin * sin);
        self.half = [cos * norm, sin * norm];
    }
}
