//! The linear correction of a measurement.

use nalgebra::{Matrix3, Vector3};

/// A calibration: the true vector is `matrix (measured - offset)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Linear {
    /// The sensor's reading for a zero input, in its unit, body frame.
    pub offset: Vector3<f64>,
    /// Scale and misalignment, and the change of unit if there is one.
    pub matrix: Matrix3<f64>,
}

impl Linear {
    /// Calibration of a sensor that needs none.
    pub const IDENTITY: Self = Self {
        offset: Vector3::new(0.0, 0.0, 0.0),
        matrix: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
    };

    /// The true vector.
    pub fn apply(&self, measured: &Vector3<f64>) -> Vector3<f64> {
        self.matrix * (measured - self.offset)
    }
}

impl Default for Linear {
    fn default() -> Self {
        Self::IDENTITY
    }
}
