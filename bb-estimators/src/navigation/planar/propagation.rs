//! One sample of the gyroscope: an arc, exact while the velocity in the body and the yaw rate are constant.
//!
//! With `R` from body to world at the start of the sample, ω constant over it, φ = ω dt and `V(φ) = ∫₀¹ R(s φ) ds`:
//!
//! * `p⁺ = p + d`, with `d = R V v dt`
//! * `ψ⁺ = ψ + φ`
//!
//! and for the errors, with `ω_true = ω - δb` and `J` the turn by a quarter:
//!
//! * `δp⁺ = δp + J d δψ + R V dt δv - R ∂V/∂φ v dt² δb`
//! * `δψ⁺ = δψ - dt δb`

use nalgebra::{Matrix2, SMatrix, Vector2};

use super::estimate::{GYROSCOPE_BIAS, HEADING, POSITION, PlanarEstimate, STATES, VELOCITY, left};
use super::params::Densities;
use crate::navigation::math::{cos, sin, wrapped};

/// Below this angle, rad, the integral over an arc is a series.
const SERIES: f64 = 1e-2;

/// What a sample does to the errors.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transition {
    /// Of the errors: the identity, but for what is above.
    pub(super) matrix: SMatrix<f64, STATES, STATES>,
    /// R in the middle of the sample, where noise comes in on average.
    rotation: Matrix2<f64>,
    /// J d, m.
    sideways: Vector2<f64>,
    dt: f64,
}

impl Transition {
    /// Moves the estimate over `dt` seconds with the yaw rate that it holds.
    #[inline]
    pub(super) fn advance(estimate: &mut PlanarEstimate, dt: f64) -> Self {
        let turn = estimate.yaw_rate * dt;
        let (arc, by_turn) = arc(turn);
        let world_from_body = estimate.world_from_body();
        let by_velocity = world_from_body * arc * dt;
        let way = by_velocity * estimate.velocity;
        let sideways = left(&way);
        let by_bias = world_from_body * by_turn * estimate.velocity * (-dt * dt);
        estimate.position += way;
        let rotation = PlanarEstimate { heading: estimate.heading + 0.5 * turn, ..*estimate }.world_from_body();
        estimate.heading = wrapped(estimate.heading + turn);
        let mut matrix = SMatrix::<f64, STATES, STATES>::identity();
        matrix.fixed_view_mut::<2, 1>(POSITION, HEADING).copy_from(&sideways);
        matrix.fixed_view_mut::<2, 2>(POSITION, VELOCITY).copy_from(&by_velocity);
        matrix.fixed_view_mut::<2, 1>(POSITION, GYROSCOPE_BIAS).copy_from(&by_bias);
        matrix[(HEADING, GYROSCOPE_BIAS)] = -dt;
        Self { matrix, rotation, sideways, dt }
    }

    /// `P ← Φ P Φᵀ + Q`, symmetric to the last bit.
    #[inline]
    pub(super) fn apply(&self, p: &mut [[f64; STATES]; STATES], densities: &Densities) {
        // Rows are columns.
        let moved = self.matrix * SMatrix::from(*p) * self.matrix.transpose() + self.noise(densities);
        for i in 0..STATES {
            for j in 0..=i {
                p[i][j] = moved[(i, j)];
                p[j][i] = moved[(i, j)];
            }
        }
    }

    /// White noise of density q on a derivative: `q [dt³/3, dt²/2; dt²/2, dt]` on what integrates it.
    fn noise(&self, densities: &Densities) -> SMatrix<f64, STATES, STATES> {
        let dt = self.dt;
        let mut noise = SMatrix::<f64, STATES, STATES>::zeros();
        let [forward, lateral] = densities.acceleration;
        let of_velocity = Matrix2::new(forward, 0.0, 0.0, lateral) * dt;
        // The heading errs by half of it on average over the sample, and so does the way.
        let of_heading = densities.gyroscope * dt;
        let position = self.rotation * of_velocity * self.rotation.transpose() * (dt * dt / 3.0)
            + self.sideways * self.sideways.transpose() * (of_heading / 3.0);
        noise.fixed_view_mut::<2, 2>(POSITION, POSITION).copy_from(&position);
        noise.fixed_view_mut::<2, 2>(VELOCITY, VELOCITY).copy_from(&of_velocity);
        let between = self.rotation * of_velocity * (0.5 * dt);
        noise.fixed_view_mut::<2, 2>(POSITION, VELOCITY).copy_from(&between);
        noise.fixed_view_mut::<2, 2>(VELOCITY, POSITION).copy_from(&between.transpose());
        let between = self.sideways * (0.5 * of_heading);
        noise.fixed_view_mut::<2, 1>(POSITION, HEADING).copy_from(&between);
        noise.fixed_view_mut::<1, 2>(HEADING, POSITION).copy_from(&between.transpose());
        noise[(HEADING, HEADING)] = of_heading;
        noise[(GYROSCOPE_BIAS, GYROSCOPE_BIAS)] = densities.bias * dt;
        noise
    }
}

/// `V(φ) = ∫₀¹ R(s φ) ds` and its derivative by φ.
fn arc(turn: f64) -> (Matrix2<f64>, Matrix2<f64>) {
    let s = turn * turn;
    let [along, across, along_turn, across_turn] = if turn.abs() < SERIES {
        [
            1.0 - s / 6.0 * (1.0 - s / 20.0),
            turn / 2.0 * (1.0 - s / 12.0 * (1.0 - s / 30.0)),
            -turn / 3.0 * (1.0 - s / 10.0),
            0.5 - s / 8.0 * (1.0 - s / 18.0),
        ]
    } else {
        let (sin, cos) = (sin(turn), cos(turn));
        let (along, across) = (sin / turn, (1.0 - cos) / turn);
        [along, across, (cos - along) / turn, (sin - across) / turn]
    };
    let matrix = |along: f64, across: f64| Matrix2::new(along, -across, across, along);
    (matrix(along, across), matrix(along_turn, across_turn))
}
