//! One landmark: where it is, who saw it, and what eliminating it says of the poses that did.
//!
//! With the direction d from the body to the landmark l in the world, what the camera sees changes by
//! `B (δl - δp + d × θ)`: all Jacobians are made of the 2 × 3 matrix B. So the normal matrix of landmark and poses is made of
//! `Nᵢ = Bᵢᵀ Bᵢ` and `Dᵢ = [-I | [dᵢ]×]`, and eliminating the landmark, whose own matrix is `V = Π + Σ Nᵢ` with its prior Π,
//! leaves `Σ Dᵢᵀ Nᵢ Dᵢ - Yᵀ Y` with `Yᵢ = V^-½ Nᵢ Dᵢ`. One more observation adds two rows to that:
//! `(I + B V⁻¹ Bᵀ)^-½ [-B V⁻¹ Nᵢ Dᵢ … B D]`. Moving and turning all of the world changes none of it but by the prior.

#![allow(clippy::needless_range_loop, reason = "the indices are those of the equations")]

use alloc::vec::Vec;

use nalgebra::{Matrix2x3, Matrix3, SMatrix, Vector2, Vector3};

use super::coupling::{Coupling, POSE, PoseInformation, place};
use super::keyframe::{Keyframe, Window};
use crate::navigation::camera::{Camera, Undistorted, normalised};
use crate::navigation::math::sqrt;
use crate::navigation::state::{POSITION, ROTATION, States};

/// Where a landmark was seen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sight {
    /// Of the keyframe, counted as by [`Coupling::first`].
    pub(super) serial: u64,
    /// Which linearisation of the keyframe it has.
    pub(super) version: u32,
    pub(super) seen: Undistorted,
    /// What the inverse of the standard deviation of a pixel is, as the stream has it.
    pub(super) precision: f64,
    /// What the kernel makes of it.
    pub(super) weight: f64,
    /// B and what is left to explain, divided by the noise.
    pub(super) jacobian: Matrix2x3<f64>,
    pub(super) residual: Vector2<f64>,
    /// d.
    pub(super) arm: Vector3<f64>,
}

/// See the module.
#[derive(Clone, Debug)]
pub(super) struct Landmark {
    pub(super) id: u64,
    /// Where it is linearised.
    pub(super) point: Vector3<f64>,
    /// Its mean, and the inverse of its variance; none without a guess.
    pub(super) prior: Option<(Vector3<f64>, f64)>,
    /// Whether its place is known, and so the window uses it.
    pub(super) is_used: bool,
    /// Whether more may be added: the last observations of a landmark that is lost stay.
    pub(super) is_open: bool,
    /// The keyframe that saw it last.
    pub(super) last: u64,
    pub(super) refused_in_a_row: u32,
    /// In the order of time.
    pub(super) sights: Vec<Sight>,
    /// V⁻¹ and `V⁻¹ b`, where b is what prior and observations pull.
    inverse: Matrix3<f64>,
    mean: Vector3<f64>,
}

impl Landmark {
    pub(super) fn new(sights: usize) -> Self {
        Self {
            id: 0,
            point: Vector3::zeros(),
            prior: None,
            is_used: false,
            is_open: false,
            last: 0,
            refused_in_a_row: 0,
            sights: Vec::with_capacity(sights),
            inverse: Matrix3::zeros(),
            mean: Vector3::zeros(),
        }
    }

    /// Begins another in its place.
    pub(super) fn renew(&mut self, id: u64, prior: Option<(Vector3<f64>, f64)>) {
        self.id = id;
        self.point = prior.map_or(Vector3::zeros(), |(mean, _)| mean);
        self.prior = prior;
        self.is_used = prior.is_some();
        self.is_open = true;
        self.refused_in_a_row = 0;
        self.sights.clear();
        self.sum();
    }

    /// B V⁻¹ Bᵀ of any B.
    pub(super) fn spread(&self, jacobian: &Matrix2x3<f64>) -> SMatrix<f64, 2, 2> {
        jacobian * self.inverse * jacobian.transpose()
    }

    /// What part of it is the prior's: `V⁻¹ Π`.
    pub(super) fn held(&self) -> Matrix3<f64> {
        self.prior.map_or(Matrix3::zeros(), |(_, weight)| self.inverse * weight)
    }

    /// Sums up prior and observations. Where that does not determine where it is, it is not used until something does.
    pub(super) fn sum(&mut self) {
        let mut matrix = Matrix3::zeros();
        let mut vector = Vector3::zeros();
        if let Some((mean, weight)) = self.prior {
            matrix += Matrix3::from_diagonal_element(weight);
            vector += (mean - self.point) * weight;
        }
        for sight in &self.sights {
            matrix += sight.normal();
            vector += sight.jacobian.transpose() * sight.residual * sight.weight;
        }
        let inverse = matrix.cholesky().map(|root| root.inverse());
        let inverse = inverse.filter(|inverse| inverse.iter().all(|x| x.is_finite()));
        self.is_used &= inverse.is_some();
        self.inverse = inverse.unwrap_or_else(Matrix3::zeros);
        self.mean = self.inverse * vector;
    }

    /// How far it is estimated to be from where it is linearised.
    pub(super) fn correction<F, const N: usize>(&self, window: &Window<F, N>, first: u64) -> Vector3<f64> {
        let mut pull = Vector3::zeros();
        for sight in &self.sights {
            let Some(keyframe) = window.get((sight.serial - first) as usize) else { continue };
            pull += sight.normal() * sight.moved(&keyframe.correction);
        }
        self.mean - self.inverse * pull
    }

    /// Adds to Λ what it says of the poses, or takes it away again: all as it was linearised.
    pub(super) fn add_to<const N: usize>(&self, coupling: &mut Coupling<N>, rows: &mut [Vec<f64>; 3], sign: f64) {
        let Some(root) = self.inverse.cholesky().map(|root| root.l()) else { return };
        let Some((from, to)) = self.range(coupling.first, rows) else { return };
        for sight in &self.sights {
            let index = (sight.serial - coupling.first) as usize;
            coupling.add_pose(index, &sight.information(), sign);
            // With V⁻¹ = L Lᵀ, Y = Lᵀ N D.
            let share = root.transpose() * sight.normal();
            for (i, row) in rows.iter_mut().enumerate() {
                sight.write(&share.row(i).transpose(), &mut row[POSE * index..]);
            }
        }
        // Lᵀ b = L⁻¹ V⁻¹ b
        let residual = root.solve_lower_triangular(&self.mean).unwrap_or_else(Vector3::zeros);
        let [a, b, c] = &*rows;
        coupling.add_rows((from, to), &[a, b, c], &residual.into(), -sign);
    }

    /// Adds what one more observation says, before that is among its own, or takes it away, once it is not any more.
    pub(super) fn add_one<const N: usize>(
        &self,
        sight: &Sight,
        coupling: &mut Coupling<N>,
        rows: &mut [Vec<f64>; 3],
        sign: f64,
    ) {
        let weight = sqrt(sight.weight);
        let jacobian = sight.jacobian * weight;
        let index = (sight.serial - coupling.first) as usize;
        let (mut from, mut to) = self.range(coupling.first, rows).unwrap_or((index, index + 1));
        // What is between must be zero as well.
        for row in rows.iter_mut() {
            row[POSE * index..POSE * (index + 1)].fill(0.0);
            if index >= to {
                row[POSE * to..POSE * index].fill(0.0);
            } else if index < from {
                row[POSE * index..POSE * from].fill(0.0);
            }
        }
        (from, to) = (from.min(index), to.max(index + 1));
        let covariance = SMatrix::<f64, 2, 2>::identity() + self.spread(&jacobian);
        let Some(root) = covariance.cholesky().map(|root| root.l()) else { return };
        let divided = |rows: Matrix2x3<f64>| root.solve_lower_triangular(&rows).unwrap_or_else(Matrix2x3::zeros);
        let by_landmark = divided(jacobian * self.inverse);
        for other in &self.sights {
            let index = (other.serial - coupling.first) as usize;
            let share = by_landmark * other.normal();
            for i in 0..2 {
                other.write(&-share.row(i).transpose(), &mut rows[i][POSE * index..]);
            }
        }
        let own = divided(jacobian);
        for i in 0..2 {
            sight.write(&own.row(i).transpose(), &mut rows[i][POSE * index..]);
        }
        let residual = sight.residual * weight - jacobian * self.mean;
        let residual = root.solve_lower_triangular(&residual).unwrap_or_else(Vector2::zeros);
        let [a, b, _] = &*rows;
        coupling.add_rows((from, to), &[a, b], &residual.into(), sign);
    }

    /// The poses from the first to the last that saw it, and zeros in the rows there.
    fn range(&self, first: u64, rows: &mut [Vec<f64>; 3]) -> Option<(usize, usize)> {
        let from = (self.sights.first()?.serial - first) as usize;
        let to = (self.sights.last()?.serial - first) as usize + 1;
        for row in rows {
            row[POSE * from..POSE * to].fill(0.0);
        }
        Some((from, to))
    }
}

impl Sight {
    /// N.
    pub(super) fn normal(&self) -> Matrix3<f64> {
        self.jacobian.transpose() * self.jacobian * self.weight
    }

    /// Linearises at a keyframe and a landmark; not if that would be behind the camera.
    pub(super) fn linearise<F, const N: usize>(
        &mut self,
        camera: &Camera,
        keyframe: &Keyframe<F, N>,
        point: &Vector3<f64>,
    ) -> bool {
        let at = &keyframe.point;
        let (camera_from_world, centre) = camera.placed(&at.position, &at.world_from_body);
        let Some((expected, by_point)) = normalised(&(camera_from_world * (point - centre))) else { return false };
        let noise = self.seen.jacobian * self.precision;
        self.jacobian = noise * by_point * camera_from_world;
        self.residual = noise * (self.seen.direction - expected);
        self.arm = point - at.position;
        self.version = keyframe.version;
        self.jacobian.iter().chain(self.residual.iter()).all(|x| x.abs() < 1e12)
    }

    /// B and the residual where keyframe and landmark are estimated to be.
    pub(super) fn estimated<F, S: States, const N: usize>(
        &self,
        camera: &Camera,
        keyframe: &Keyframe<F, N>,
        point: &Vector3<f64>,
    ) -> Option<(Matrix2x3<f64>, Vector2<f64>)> {
        let at = keyframe.estimate::<S>();
        let (camera_from_world, centre) = camera.placed(&at.position, &at.world_from_body);
        let (expected, by_point) = normalised(&(camera_from_world * (point - centre)))?;
        let noise = self.seen.jacobian * self.precision;
        Some((noise * by_point * camera_from_world, noise * (self.seen.direction - expected)))
    }

    /// `D δ`.
    pub(super) fn moved<const N: usize>(&self, correction: &[f64; N]) -> Vector3<f64> {
        let part = |first: usize| Vector3::new(correction[first], correction[first + 1], correction[first + 2]);
        self.arm.cross(&part(ROTATION)) - part(POSITION)
    }

    /// `share D`.
    fn write(&self, share: &Vector3<f64>, target: &mut [f64]) {
        let turned = share.cross(&self.arm);
        for i in 0..3 {
            target[i] = -share[i];
            target[3 + i] = turned[i];
        }
    }

    /// What it says of its pose if the landmark is where it is linearised.
    fn information(&self) -> PoseInformation {
        let mut information = PoseInformation::none();
        let mut rows = [[0.0; POSE]; 2];
        for (i, row) in rows.iter_mut().enumerate() {
            self.write(&self.jacobian.row(i).transpose(), row);
            for j in 0..POSE {
                let factor = row[j] * self.weight;
                information.vector[j] += factor * self.residual[i];
                for k in j..POSE {
                    information.matrix[j][k] += factor * row[k];
                }
            }
        }
        information
    }
}

/// The block of a pose in a covariance of a keyframe.
pub(super) fn pose_block<const N: usize>(covariance: &[[f64; N]; N]) -> SMatrix<f64, POSE, POSE> {
    SMatrix::from_fn(|i, j| covariance[place(i)][place(j)])
}
