//! One sample of the IMU: exact for the mean, first order for the errors.
//!
//! With `R` from body to world at the start of the sample, ω and f constant over it, φ = ω dt and the integrals Γ1 and
//! Γ2 of the rotation group (`math.rs`):
//!
//! * `R⁺ = R exp(φ)`
//! * `v⁺ = v + R Γ1 f dt + g dt`
//! * `p⁺ = p + v dt + R Γ2 f dt² + ½ g dt²`
//!
//! The rotation error is in the world frame, `R_true = exp(θ) R`, so it has no transition of its own. With `ω_true = ω - δb_g`,
//! `f_true = f - δb_a`:
//!
//! * `θ⁺ = θ - R Γ1 dt δb_g`
//! * `δv⁺ = δv - [R Γ1 f dt]× θ - R Γ1 dt δb_a - R ∂(Γ1 f)/∂φ dt² δb_g`
//! * `δp⁺ = δp + δv dt - [R Γ2 f dt²]× θ - R Γ2 dt² δb_a - R ∂(Γ2 f)/∂φ dt³ δb_g`
//!
//! J. Solà, "Quaternion kinematics for the error-state Kalman filter", arXiv 1711.02508, 2017, section 7, with global angular
//! errors. The transition is the identity except for blocks above the diagonal; only these are multiplied.

#![allow(clippy::needless_range_loop, reason = "the indices are those of the equations")]

#[cfg(test)]
use nalgebra::SMatrix;
use nalgebra::{Matrix3, Vector3};

use super::params::ImuDensities;
use crate::navigation::bounds::above_rounding;
use crate::navigation::math::{Integrals, renormalised, rotation, skew};
use crate::navigation::state::{
    ACCELEROMETER_BIAS, Estimate, GYROSCOPE_BIAS, NAVIGATION, POSITION, ROTATION, VELOCITY,
};

/// The errors from [`ROTATION`] on that are integrated into position and velocity: rotation and both biases.
pub(in crate::navigation) const SOURCES: usize = NAVIGATION - ROTATION;

/// The effect of a sample on the errors: the blocks of the transition that are neither zero nor the identity.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation) struct Transition {
    /// Derivative of the position error with respect to the velocity error, s.
    pub(in crate::navigation) dt: f64,
    /// Derivative of the position error with respect to the rotation error and the biases, row by row.
    pub(in crate::navigation) position: [[f64; SOURCES]; 3],
    /// Derivative of the velocity error with respect to the same errors.
    pub(in crate::navigation) velocity: [[f64; SOURCES]; 3],
    /// Derivative of the rotation error with respect to the gyroscope's bias.
    pub(in crate::navigation) rotation: [[f64; 3]; 3],
}

impl Transition {
    /// Propagates the estimate over `dt` seconds with the angular velocity and specific force that it holds.
    #[inline]
    pub(super) fn advance<const N: usize>(estimate: &mut Estimate<N>, dt: f64, gravity: f64) -> Self {
        let force = estimate.specific_force;
        let turn = estimate.angular_velocity * dt;
        let integrals = Integrals::new(&turn);
        let world_from_body = estimate.rotation();
        let first = world_from_body * integrals.first_matrix(&turn) * dt;
        let second = world_from_body * integrals.second_matrix(&turn) * (dt * dt);
        let velocity_change = first * force;
        let position_change = second * force;

        let fall = Vector3::new(0.0, 0.0, -gravity * dt);
        estimate.position += estimate.velocity * dt + position_change + fall * (0.5 * dt);
        estimate.velocity += velocity_change + fall;
        estimate.world_from_body = renormalised(&(estimate.world_from_body * rotation(&turn)));

        // ∂(Γ f)/∂φ to second order in φ: of c₁ φ × f + c₂ φ × (φ × f), [φ]×[f]× = f φᵀ - (φ·f) I.
        let linear = skew(&force);
        let square = skew(&turn.cross(&force)) + force * turn.transpose() - Matrix3::identity() * turn.dot(&force);
        let by_turn = |c1: f64, c2: f64| world_from_body * (linear * c1 + square * c2);
        let velocity_turn = by_turn(0.5, 1.0 / 6.0) * (dt * dt);
        let position_turn = by_turn(1.0 / 6.0, 1.0 / 24.0) * (dt * dt * dt);
        Self {
            dt,
            position: rows(&-skew(&position_change), &-second, &position_turn),
            velocity: rows(&-skew(&velocity_change), &-first, &velocity_turn),
            rotation: core::array::from_fn(|i| core::array::from_fn(|k| -first[(i, k)])),
        }
    }

    /// `P ← Φ P Φᵀ + Q`.
    #[inline]
    pub(in crate::navigation) fn apply<const N: usize>(&self, p: &mut [[f64; N]; N], densities: &ImuDensities) {
        // Φ P: each row reads only rows below it, which have not changed yet. Only columns that are read or kept are computed.
        for i in 0..3 {
            let mut row = p[POSITION + i];
            for j in 0..N {
                let mut sum = row[j] + self.dt * p[VELOCITY + i][j];
                for k in 0..SOURCES {
                    sum += self.position[i][k] * p[ROTATION + k][j];
                }
                row[j] = sum;
            }
            p[POSITION + i] = row;
        }
        for i in 0..3 {
            let mut row = p[VELOCITY + i];
            for j in VELOCITY..N {
                let mut sum = row[j];
                for k in 0..SOURCES {
                    sum += self.velocity[i][k] * p[ROTATION + k][j];
                }
                row[j] = sum;
            }
            p[VELOCITY + i] = row;
        }
        for i in 0..3 {
            let mut row = p[ROTATION + i];
            for j in ROTATION..N {
                let mut sum = row[j];
                for k in 0..3 {
                    sum += self.rotation[i][k] * p[GYROSCOPE_BIAS + k][j];
                }
                row[j] = sum;
            }
            p[ROTATION + i] = row;
        }
        // (Φ P) Φᵀ: only the first nine columns change, and only their upper triangle is computed.
        for i in 0..3 {
            let mut row = p[POSITION + i];
            for j in i..3 {
                row[j] += self.dt * row[VELOCITY + j] + dot(&self.position[j], &row);
            }
            for j in 0..3 {
                row[VELOCITY + j] += dot(&self.velocity[j], &row);
            }
            self.rotation_columns(&mut row, 0);
            p[POSITION + i] = row;
        }
        for i in 0..3 {
            let mut row = p[VELOCITY + i];
            for j in i..3 {
                row[VELOCITY + j] += dot(&self.velocity[j], &row);
            }
            self.rotation_columns(&mut row, 0);
            p[VELOCITY + i] = row;
        }
        for i in 0..3 {
            let mut row = p[ROTATION + i];
            self.rotation_columns(&mut row, i);
            p[ROTATION + i] = row;
        }
        self.add_noise(p, densities);
        for i in 0..ROTATION + 3 {
            for j in i + 1..N {
                p[j][i] = p[i][j];
            }
        }
    }

    #[inline]
    fn rotation_columns<const N: usize>(&self, row: &mut [f64; N], from: usize) {
        for j in from..3 {
            for k in 0..3 {
                row[ROTATION + j] += self.rotation[j][k] * row[GYROSCOPE_BIAS + k];
            }
        }
    }

    /// White noise of density q on a derivative: `q [dt³/3, dt²/2; dt²/2, dt]` on position and velocity. At least the amount that
    /// rounding may have removed.
    #[inline]
    fn add_noise<const N: usize>(&self, p: &mut [[f64; N]; N], densities: &ImuDensities) {
        let dt = self.dt;
        let velocity = densities.accelerometer * dt;
        for i in 0..3 {
            let add = |variance: &mut f64, noise: f64| *variance += above_rounding(noise, *variance);
            add(&mut p[POSITION + i][POSITION + i], velocity * dt * dt / 3.0);
            p[POSITION + i][VELOCITY + i] += velocity * dt * 0.5;
            add(&mut p[VELOCITY + i][VELOCITY + i], velocity);
            add(&mut p[ROTATION + i][ROTATION + i], densities.gyroscope * dt);
            p[ACCELEROMETER_BIAS + i][ACCELEROMETER_BIAS + i] += densities.accelerometer_bias * dt;
            p[GYROSCOPE_BIAS + i][GYROSCOPE_BIAS + i] += densities.gyroscope_bias * dt;
        }
    }

    /// The whole transition.
    #[cfg(test)]
    pub(super) fn matrix<const N: usize>(&self) -> SMatrix<f64, N, N> {
        let mut matrix = SMatrix::identity();
        for i in 0..3 {
            matrix[(POSITION + i, VELOCITY + i)] = self.dt;
            for k in 0..SOURCES {
                matrix[(POSITION + i, ROTATION + k)] = self.position[i][k];
                matrix[(VELOCITY + i, ROTATION + k)] = self.velocity[i][k];
            }
            for k in 0..3 {
                matrix[(ROTATION + i, GYROSCOPE_BIAS + k)] = self.rotation[i][k];
            }
        }
        matrix
    }
}

#[inline]
pub(in crate::navigation) fn rows(
    rotation: &Matrix3<f64>,
    force: &Matrix3<f64>,
    turn: &Matrix3<f64>,
) -> [[f64; SOURCES]; 3] {
    core::array::from_fn(|i| {
        core::array::from_fn(|k| match k {
            0..=2 => rotation[(i, k)],
            3..=5 => force[(i, k - 3)],
            _ => turn[(i, k - 6)],
        })
    })
}

#[inline]
fn dot<const N: usize>(factors: &[f64; SOURCES], row: &[f64; N]) -> f64 {
    let mut sum = 0.0;
    for k in 0..SOURCES {
        sum += factors[k] * row[ROTATION + k];
    }
    sum
}
