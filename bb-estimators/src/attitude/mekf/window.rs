//! Sums over one window of samples, in a world frame that is not corrected within it.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::iron::FieldMeans;
use super::states::{BIAS, CALIBRATION};
use crate::attitude::Real;

/// A window ends after this many samples: enough to do the filter's work in small pieces, one with each.
const SAMPLES: u32 = 8;

/// A window ends after this time, s, however few samples it has: corrections wait for its end.
const LONGEST_S: f64 = 0.1;

/// Integrals over the samples of a window.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Window<T> {
    samples: u32,
    /// s.
    pub(super) duration: T,
    /// ∫ R f dt, m/s.
    pub(super) force: Vector3<T>,
    /// ∫ R (ω × f) dt, m/s².
    pub(super) force_rate: Vector3<T>,
    /// ∫ R dt, s.
    rotation: Matrix3<T>,
    /// ∫ R ⊗ ω dt, rad: row i, then the body axis that R takes to i, then the axis of ω.
    rotation_rate: [[T; 9]; 3],
    /// ∫ |ω|² dt, rad²/s.
    pub(super) squared_rate: T,
    /// Σ R m.
    field: Vector3<T>,
    /// Σ R (ω × (m - b)).
    field_rate: Vector3<T>,
    /// Σ R over the samples of the field.
    field_rotation: Matrix3<T>,
    fields: u32,
}

impl<T: Real> Window<T> {
    pub(super) fn new() -> Self {
        Self {
            samples: 0,
            duration: T::ZERO,
            force: Vector3::zeros(),
            force_rate: Vector3::zeros(),
            rotation: Matrix3::zeros(),
            rotation_rate: [[T::ZERO; 9]; 3],
            squared_rate: T::ZERO,
            field: Vector3::zeros(),
            field_rate: Vector3::zeros(),
            field_rotation: Matrix3::zeros(),
            fields: 0,
        }
    }

    pub(super) fn is_full(&self) -> bool {
        self.samples >= SAMPLES || self.duration >= T::of(LONGEST_S)
    }

    /// Adds a specific force that was measured with the sensor at `rotation`, turning at `rate`.
    pub(super) fn add_force(&mut self, dt: T, rotation: &Matrix3<T>, rate: &Vector3<T>, force: &Vector3<T>) {
        let force = force * dt;
        self.force += rotation * force;
        self.force_rate += rotation * rate.cross(&force);
    }

    /// Adds an angular velocity, the mean over `dt`, in the middle of which the rotation was `rotation`.
    pub(super) fn add_rate(&mut self, dt: T, rotation: &Matrix3<T>, rate: &Vector3<T>) {
        self.samples += 1;
        self.duration += dt;
        let rotation = rotation * dt;
        self.rotation += rotation;
        for (i, row) in self.rotation_rate.iter_mut().enumerate() {
            for k in 0..3 {
                for j in 0..3 {
                    row[3 * k + j] += rotation[(i, k)] * rate[j];
                }
            }
        }
        self.squared_rate += rate.norm_squared() * dt;
    }

    /// Adds a magnetic field measured with the sensor at `rotation`, turning at `rate`; `offset` is the part that
    /// turns with the body.
    pub(super) fn add_field(
        &mut self,
        rotation: &Matrix3<T>,
        rate: &Vector3<T>,
        field: &Vector3<T>,
        offset: &Vector3<T>,
    ) {
        self.field += rotation * field;
        self.field_rate += rotation * rate.cross(&(field - offset));
        self.field_rotation += rotation;
        self.fields += 1;
    }

    /// Means over the fields in the world corrected by `correction`, if there was a field.
    pub(super) fn mean_field(&self, correction: &UnitQuaternion<T>) -> Option<FieldMeans<T>> {
        let scale = T::ONE / T::of(f64::from(self.fields.max(1)));
        let correction = *correction.to_rotation_matrix().matrix() * scale;
        (self.fields > 0).then(|| FieldMeans {
            rotation: correction * self.field_rotation,
            field: correction * self.field,
            rate: correction * self.field_rate,
        })
    }

    /// How bias and calibration rotate the world in this window, rad per rad/s and rad per fraction.
    pub(super) fn gyroscope_integrals(&self) -> [[T; 12]; 3] {
        let mut integrals = [[T::ZERO; 12]; 3];
        for (i, row) in integrals.iter_mut().enumerate() {
            let (bias, calibration) = row.split_at_mut(CALIBRATION - BIAS);
            for (k, value) in bias.iter_mut().enumerate() {
                *value = -self.rotation[(i, k)];
            }
            for (value, integral) in calibration.iter_mut().zip(&self.rotation_rate[i]) {
                *value = -*integral;
            }
        }
        integrals
    }
}
