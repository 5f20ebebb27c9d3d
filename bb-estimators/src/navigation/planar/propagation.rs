//! Propagation over one gyroscope sample: an arc, exact while the velocity in the body and the yaw rate are constant.
//!
//! With `R` from body to world at the start of the sample, ω constant over it, φ = ω dt and `V(φ) = ∫₀¹ R(s φ) ds`:
//!
//! * `p⁺ = p + d`, with `d = R V v dt`
//! * `ψ⁺ = ψ + φ`
//!
//! and for the errors, with `ω_true = ω - δb` and `J` the rotation by 90°:
//!
//! * `δp⁺ = δp + J d δψ + R V dt δv - R ∂V/∂φ v dt² δb`
//! * `δψ⁺ = δψ - dt δb`

#![allow(clippy::needless_range_loop, reason = "the indices are those of the equations")]

use core::f64::consts::PI;

#[cfg(test)]
use nalgebra::SMatrix;
use nalgebra::{Matrix2, Vector2};

use super::arc::arc;
use super::estimate::{GYROSCOPE_BIAS, HEADING, POSITION, PlanarEstimate, STATES, VELOCITY, left};
use super::params::Densities;
use crate::navigation::bounds::above_rounding;
use crate::navigation::math::wrapped;

/// The errors from [`HEADING`] on that are integrated into the position: heading, velocity and gyroscope bias.
const SOURCES: usize = GYROSCOPE_BIAS + 1 - HEADING;

/// The effect of a sample on the errors: the blocks of the transition that are neither zero nor the identity.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transition {
    /// Derivative of the position error with respect to heading, velocity and bias, row by row; its first column is J d.
    position: [[f64; SOURCES]; 2],
    /// R in the middle of the sample, where noise enters on average.
    rotation: Matrix2<f64>,
    dt: f64,
}

impl Transition {
    /// Propagates the estimate over `dt` seconds with the yaw rate that it holds.
    #[inline]
    pub(super) fn advance(estimate: &mut PlanarEstimate, dt: f64) -> Self {
        let turn = estimate.yaw_rate * dt;
        let (arc, by_turn) = arc(turn);
        let world_from_body = estimate.world_from_body();
        let by_velocity = world_from_body * arc * dt;
        let way = by_velocity * estimate.velocity;
        let sideways = left(&way);
        let by_bias = world_from_body * by_turn * estimate.velocity * (-dt * dt);
        let rotation = PlanarEstimate { heading: estimate.heading + 0.5 * turn, ..*estimate }.world_from_body();
        estimate.position += way;
        estimate.heading += turn;
        if !(-PI..=PI).contains(&estimate.heading) {
            estimate.heading = wrapped(estimate.heading);
        }
        let row = |i: usize| [sideways[i], by_velocity[(i, 0)], by_velocity[(i, 1)], by_bias[i]];
        Self { position: [row(0), row(1)], rotation, dt }
    }

    /// `P ← Φ P Φᵀ + Q`, exactly symmetric.
    #[inline]
    pub(super) fn apply(&self, p: &mut [[f64; STATES]; STATES], densities: &Densities) {
        // Φ P: each row reads only rows below it, which have not changed yet.
        for i in 0..2 {
            for (k, factor) in self.position[i].iter().enumerate() {
                for j in 0..STATES {
                    p[POSITION + i][j] += factor * p[HEADING + k][j];
                }
            }
        }
        for j in 0..STATES {
            p[HEADING][j] -= self.dt * p[GYROSCOPE_BIAS][j];
        }
        // (Φ P) Φᵀ: only the first three columns change.
        for row in p.iter_mut() {
            for i in 0..2 {
                for (k, factor) in self.position[i].iter().enumerate() {
                    row[POSITION + i] += factor * row[HEADING + k];
                }
            }
            row[HEADING] -= self.dt * row[GYROSCOPE_BIAS];
        }
        self.add_noise(p, densities);
        for i in 0..STATES {
            for j in i + 1..STATES {
                p[j][i] = p[i][j];
            }
        }
    }

    /// White noise of density q on a derivative: `q [dt³/3, dt²/2; dt²/2, dt]` on its integral, upper triangle only. At least the
    /// amount that rounding may have removed.
    #[inline]
    fn add_noise(&self, p: &mut [[f64; STATES]; STATES], densities: &Densities) {
        let dt = self.dt;
        let acceleration = densities.acceleration.map(|density| density * dt);
        // Over the sample, the mean heading error is half of the final one, and so is its effect on the displacement.
        let heading = densities.gyroscope * dt;
        let sideways = Vector2::new(self.position[0][0], self.position[1][0]);
        let (forward, left) = (self.rotation.column(0), self.rotation.column(1));
        for i in 0..2 {
            for j in i..2 {
                let turned = forward[i] * forward[j] * acceleration[0] + left[i] * left[j] * acceleration[1];
                let noise = turned * (dt * dt / 3.0) + sideways[i] * sideways[j] * (heading / 3.0);
                let entry = &mut p[POSITION + i][POSITION + j];
                *entry += if i == j { above_rounding(noise, *entry) } else { noise };
            }
            p[POSITION + i][HEADING] += sideways[i] * (0.5 * heading);
            p[POSITION + i][VELOCITY] += forward[i] * acceleration[0] * (0.5 * dt);
            p[POSITION + i][VELOCITY + 1] += left[i] * acceleration[1] * (0.5 * dt);
            p[VELOCITY + i][VELOCITY + i] += acceleration[i];
        }
        p[HEADING][HEADING] += above_rounding(heading, p[HEADING][HEADING]);
        p[GYROSCOPE_BIAS][GYROSCOPE_BIAS] += densities.bias * dt;
    }

    /// The whole transition.
    #[cfg(test)]
    pub(super) fn matrix(&self) -> SMatrix<f64, STATES, STATES> {
        let mut matrix = SMatrix::<f64, STATES, STATES>::identity();
        for i in 0..2 {
            for k in 0..SOURCES {
                matrix[(POSITION + i, HEADING + k)] = self.position[i][k];
            }
        }
        matrix[(HEADING, GYROSCOPE_BIAS)] = -self.dt;
        matrix
    }
}
