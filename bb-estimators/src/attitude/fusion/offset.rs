//! The gyroscope's offset, measured at rest.

use core::f64::consts::PI;

use crate::attitude::Real;
use nalgebra::Vector3;

/// Corner frequency of the low-pass, Hz. Source: the library's.
const CORNER: f64 = 0.02;

/// Finds the offset of the gyroscope.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Offset<T> {
    /// rad/s.
    pub(super) offset: Vector3<T>,
    still_s: T,
}

impl<T: Real> Offset<T> {
    pub(super) fn new() -> Self {
        Self { offset: Vector3::zeros(), still_s: T::ZERO }
    }

    /// Forgets how long the sensor has been still, but not the offset.
    pub(super) fn forget_motion(&mut self) {
        self.still_s = T::ZERO;
    }

    pub(super) fn is_still(&self, time_s: T) -> bool {
        self.still_s >= time_s
    }

    /// Takes an angular velocity, rad/s; returns it without the offset. Below `threshold`, rad/s, for `time_s`, it
    /// counts as the offset.
    #[inline]
    pub(super) fn correct(&mut self, dt_s: T, measured: &Vector3<T>, threshold: T, time_s: T) -> Vector3<T> {
        let rate = measured - self.offset;
        if rate.norm_squared() > threshold * threshold {
            self.still_s = T::ZERO;
        } else if self.still_s < time_s {
            self.still_s += dt_s;
        } else {
            self.offset += rate * (T::of(2.0 * PI * CORNER) * dt_s);
        }
        rate
    }
}
