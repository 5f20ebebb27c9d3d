//! Sums over the samples of a window.

use nalgebra::{Matrix3, Vector3};

use crate::attitude::Real;

/// Integrals over a window, in the world frame where nothing else is said.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Window<T: Real> {
    /// s.
    pub(super) duration: T,
    /// Half of the time since the last sample, s, which the present rotation counts for so far.
    pub(super) half: T,
    /// Integral of `world_from_body`, s.
    pub(super) rotation: Matrix3<T>,
    /// Integral of the specific force, m/s.
    pub(super) force: Vector3<T>,
    /// Integral of the measured angular velocity, body frame, rad.
    pub(super) measured_turn: Vector3<T>,
    /// Integral of the squared angular velocity, rad²/s.
    pub(super) squared_rate: T,
    /// Sum of the magnetic fields.
    field: Vector3<T>,
    fields: T,
}

impl<T: Real> Window<T> {
    pub(super) fn new() -> Self {
        Self {
            duration: T::ZERO,
            half: T::ZERO,
            rotation: Matrix3::zeros(),
            force: Vector3::zeros(),
            measured_turn: Vector3::zeros(),
            squared_rate: T::ZERO,
            field: Vector3::zeros(),
            fields: T::ZERO,
        }
    }

    /// Adds a sample of `dt` seconds. Returns how long the rotation before it counts.
    pub(super) fn halve(&mut self, dt: T) -> T {
        self.duration += dt;
        let half = T::HALF * dt;
        core::mem::replace(&mut self.half, half) + half
    }

    pub(super) fn add_field(&mut self, field: &Vector3<T>) {
        self.field += field;
        self.fields += T::ONE;
    }

    pub(super) fn forget_fields(&mut self) {
        self.field = Vector3::zeros();
        self.fields = T::ZERO;
    }

    pub(super) fn mean_field(&self) -> Option<Vector3<T>> {
        (self.fields > T::ZERO).then(|| self.field / self.fields)
    }
}
