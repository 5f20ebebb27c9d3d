//! The gyroscope's offset, from when the sensor lies still.

use core::f64::consts::PI;

use nalgebra::Vector3;

/// Corner frequency of the low-pass, Hz. Source: the library's.
const CORNER: f64 = 0.02;

/// Finds the offset of the gyroscope.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Offset {
    /// rad/s.
    pub(super) offset: Vector3<f64>,
    still_s: f64,
}

impl Offset {
    pub(super) fn new() -> Self {
        Self { offset: Vector3::zeros(), still_s: 0.0 }
    }

    /// Forgets how long the sensor has lain still, not the offset.
    pub(super) fn forget_motion(&mut self) {
        self.still_s = 0.0;
    }

    pub(super) fn is_still(&self, time_s: f64) -> bool {
        self.still_s >= time_s
    }

    /// Takes an angular velocity, rad/s; returns it without the offset. Below `threshold`, rad/s, for `time_s` it is
    /// the offset's.
    #[inline]
    pub(super) fn correct(
        &mut self,
        dt_s: f64,
        measured: &Vector3<f64>,
        threshold: f64,
        time_s: f64,
    ) -> Vector3<f64> {
        let rate = measured - self.offset;
        if rate.norm_squared() > threshold * threshold {
            self.still_s = 0.0;
        } else if self.still_s < time_s {
            self.still_s += dt_s;
        } else {
            self.offset += rate * (2.0 * PI * CORNER * dt_s);
        }
        rate
    }
}
