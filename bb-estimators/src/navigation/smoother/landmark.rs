//! One landmark: its position, its observations, and the information that it gives on the poses of the keyframes.
//!
//! Let d be the vector from the body to the landmark l in the world. What the camera sees changes by
//! `B (δl - δp + d × θ)`, so all Jacobians are made of the 2 × 3 matrix B. The normal matrix of landmark and poses
//! therefore consists of `Nᵢ = Bᵢᵀ Bᵢ` and `Dᵢ = [-I | [dᵢ]×]`. The landmark's own matrix is `V = Π + Σ Nᵢ` with its
//! prior Π. Eliminating the landmark leaves `Σ Dᵢᵀ Nᵢ Dᵢ - Yᵀ Y` with `Yᵢ = V^-½ Nᵢ Dᵢ`. Each further observation adds
//! two rows: `(I + B V⁻¹ Bᵀ)^-½ [-B V⁻¹ Nᵢ Dᵢ … B D]`. Moving or rotating the whole world changes only the contribution
//! of the prior.
//!
//! V⁻¹ itself is never formed. Without a guess, the first direction leaves V with a condition of 10⁹, and what remains of
//! `N - N V⁻¹ N` would be the rounding of the inverse. With `V = L Lᵀ` it is `N - (L⁻¹ N)ᵀ (L⁻¹ N)`, whose error is the rounding
//! of N.

#![allow(clippy::needless_range_loop, reason = "the indices are those of the equations")]

use alloc::vec::Vec;

use nalgebra::{Matrix2x3, Matrix3, SMatrix, UnitQuaternion, Vector2, Vector3};

use super::coupling::{Coupling, POSE, PoseInformation, Seen};
use super::kernel::Kernel;
use super::keyframe::{Keyframe, Window};
use crate::navigation::camera::{Camera, Undistorted, normalised};
use crate::navigation::math::sqrt;
use crate::navigation::state::{POSITION, ROTATION, States};

/// An observation of a landmark from one keyframe.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sight {
    /// The serial number of the keyframe, counted like [`Coupling::first`].
    pub(super) serial: u64,
    /// The version of the keyframe's linearisation that it uses.
    pub(super) version: u32,
    pub(super) seen: Undistorted,
    /// The inverse of a pixel's standard deviation, as given by the stream.
    pub(super) precision: f64,
    /// The weight given by the kernel.
    pub(super) weight: f64,
    /// The Jacobian B and the residual, divided by the noise.
    pub(super) jacobian: Matrix2x3<f64>,
    pub(super) residual: Vector2<f64>,
    /// The vector d from the body to the landmark, in the world, m.
    pub(super) arm: Vector3<f64>,
}

/// A landmark with its observations, its prior and the factor L of its normal matrix.
#[derive(Clone, Debug)]
pub(super) struct Landmark {
    pub(super) id: u64,
    /// The linearisation point.
    pub(super) point: Vector3<f64>,
    /// The mean and inverse variance of the prior; `None` without a guess.
    pub(super) prior: Option<(Vector3<f64>, f64)>,
    /// `true` if the position is known, so that the window uses the landmark.
    pub(super) is_used: bool,
    /// `true` if observations may still be added. A lost landmark keeps its last observations.
    pub(super) is_open: bool,
    /// Number among the landmarks that are unknowns of their own, once its track has outlived the window.
    pub(super) slot: Option<usize>,
    /// The information about such a landmark apart from its observations here, conditioned on everything else.
    pub(super) settled: Matrix3<f64>,
    /// The serial number of the keyframe that saw it last.
    pub(super) last: u64,
    pub(super) refused_in_a_row: u32,
    /// Observations in chronological order.
    pub(super) sights: Vec<Sight>,
    /// The Cholesky factor L of V; `None` if V is singular.
    root: Option<Matrix3<f64>>,
    /// `L⁻¹ b`, where b is the information vector of prior and observations.
    vector: Vector3<f64>,
}

impl Landmark {
    pub(super) fn new(sights: usize) -> Self {
        Self {
            id: 0,
            point: Vector3::zeros(),
            prior: None,
            is_used: false,
            is_open: false,
            slot: None,
            settled: Matrix3::zeros(),
            last: 0,
            refused_in_a_row: 0,
            sights: Vec::with_capacity(sights),
            root: None,
            vector: Vector3::zeros(),
        }
    }

    /// Reuses the storage for another landmark.
    pub(super) fn renew(&mut self, id: u64, prior: Option<(Vector3<f64>, f64)>) {
        self.id = id;
        self.point = prior.map_or(Vector3::zeros(), |(mean, _)| mean);
        self.prior = prior;
        self.is_used = prior.is_some();
        self.is_open = true;
        self.slot = None;
        self.last = 0;
        self.refused_in_a_row = 0;
        self.sights.clear();
        self.sum();
    }

    /// The covariance that its uncertainty gives an observation with the Jacobian B: `B V⁻¹ Bᵀ`.
    pub(super) fn seen_covariance(&self, jacobian: &Matrix2x3<f64>) -> SMatrix<f64, 2, 2> {
        let whitened = self.whitened(&jacobian.transpose());
        whitened.transpose() * whitened
    }

    /// `L⁻¹ M`; zero if V is singular.
    fn whitened<const C: usize>(&self, matrix: &SMatrix<f64, 3, C>) -> SMatrix<f64, 3, C> {
        let whitened = self.root.and_then(|root| root.solve_lower_triangular(matrix));
        whitened.unwrap_or_else(SMatrix::zeros)
    }

    /// `L⁻ᵀ M`; zero if V is singular.
    fn solved_back<const C: usize>(&self, matrix: &SMatrix<f64, 3, C>) -> SMatrix<f64, 3, C> {
        let solved = self.root.and_then(|root| root.tr_solve_lower_triangular(matrix));
        solved.unwrap_or_else(SMatrix::zeros)
    }

    /// The standard deviation of its position given the keyframes, m, as the root of the sum over the axes.
    pub(super) fn deviation(&self) -> f64 {
        sqrt(self.whitened(&Matrix3::identity()).norm_squared())
    }

    /// The share of the prior: `V⁻¹ Π`.
    pub(super) fn held(&self) -> Matrix3<f64> {
        let weight = self.prior.map_or(0.0, |(_, weight)| weight);
        self.solved_back(&self.whitened(&Matrix3::from_diagonal_element(weight)))
    }

    /// Sums prior and observations. If they do not determine the position, the landmark is not used until further
    /// observations do.
    pub(super) fn sum(&mut self) {
        let mut matrix = Matrix3::zeros();
        let mut vector = Vector3::zeros();
        if self.slot.is_some() {
            matrix = self.settled;
        } else if let Some((mean, weight)) = self.prior {
            matrix += Matrix3::from_diagonal_element(weight);
            vector += (mean - self.point) * weight;
        }
        for sight in &self.sights {
            matrix += sight.normal();
            vector += sight.jacobian.transpose() * sight.residual * sight.weight;
        }
        self.root = matrix.cholesky().map(|root| root.l());
        if !self.whitened(&Matrix3::identity()).iter().all(|x| x.is_finite()) {
            self.root = None;
        }
        // An unknown of its own is eliminated as such, not begun again.
        if self.slot.is_some() {
            self.is_open &= self.root.is_some();
        } else {
            self.is_used &= self.root.is_some();
        }
        self.vector = self.whitened(&vector);
    }

    /// The estimated offset from the linearisation point, for a landmark that is not an unknown of its own.
    pub(super) fn correction<F, const N: usize>(&self, window: &Window<F, N>, first: u64) -> Vector3<f64> {
        let mut pull = Vector3::zeros();
        for sight in &self.sights {
            let Some(keyframe) = window.get((sight.serial - first) as usize) else { continue };
            pull += sight.normal() * sight.moved(&keyframe.correction);
        }
        self.solved_back(&(self.vector - self.whitened(&pull)))
    }

    /// Adds its information on the poses to Λ, or removes it again, using the stored linearisation.
    pub(super) fn add_to<const N: usize>(&self, coupling: &mut Coupling<N>, rows: &mut [Vec<f64>; 3], sign: f64) {
        if self.root.is_none() {
            return;
        }
        let Some((from, to)) = self.range(coupling.first, rows) else { return };
        for sight in &self.sights {
            let index = (sight.serial - coupling.first) as usize;
            coupling.add_pose(index, &sight.information(), sign);
            // Y = L⁻¹ N D.
            let share = self.whitened(&sight.normal());
            for (i, row) in rows.iter_mut().enumerate() {
                sight.write(&share.row(i).transpose(), &mut row[POSE * index..]);
            }
        }
        let [a, b, c] = &*rows;
        coupling.add_rows((from, to), &[a, b, c], &self.vector.into(), -sign);
    }

    /// Adds the information of an observation that is not inserted yet, or removes that of one that is no longer stored.
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
        // The columns in between must be zero as well.
        for row in rows.iter_mut() {
            row[POSE * index..POSE * (index + 1)].fill(0.0);
            if index >= to {
                row[POSE * to..POSE * index].fill(0.0);
            } else if index < from {
                row[POSE * index..POSE * from].fill(0.0);
            }
        }
        (from, to) = (from.min(index), to.max(index + 1));
        // L⁻¹ Bᵀ
        let whitened = self.whitened(&jacobian.transpose());
        let covariance = SMatrix::<f64, 2, 2>::identity() + whitened.transpose() * whitened;
        let Some(root) = covariance.cholesky().map(|root| root.l()) else { return };
        let divided = |rows: Matrix2x3<f64>| root.solve_lower_triangular(&rows).unwrap_or_else(Matrix2x3::zeros);
        let by_landmark = divided(whitened.transpose());
        for other in &self.sights {
            let index = (other.serial - coupling.first) as usize;
            let share = by_landmark * self.whitened(&other.normal());
            for i in 0..2 {
                other.write(&-share.row(i).transpose(), &mut rows[i][POSE * index..]);
            }
        }
        let own = divided(jacobian);
        for i in 0..2 {
            sight.write(&own.row(i).transpose(), &mut rows[i][POSE * index..]);
        }
        let residual = sight.residual * weight - whitened.transpose() * self.vector;
        let residual = root.solve_lower_triangular(&residual).unwrap_or_else(Vector2::zeros);
        let [a, b, _] = &*rows;
        coupling.add_rows((from, to), &[a, b], &residual.into(), sign);
    }

    /// The range of poses from the first to the last that saw it. Zeroes that range in `rows`.
    fn range(&self, first: u64, rows: &mut [Vec<f64>; 3]) -> Option<(usize, usize)> {
        let from = (self.sights.first()?.serial - first) as usize;
        let to = (self.sights.last()?.serial - first) as usize + 1;
        for row in rows {
            row[POSE * from..POSE * to].fill(0.0);
        }
        Some((from, to))
    }
}

impl Camera {
    /// `camera_from_world` and the camera's centre in the world, for a pose of the body.
    pub(in crate::navigation) fn placed(
        &self,
        position: &Vector3<f64>,
        world_from_body: &UnitQuaternion<f64>,
    ) -> (Matrix3<f64>, Vector3<f64>) {
        let turned = (world_from_body * self.body_from_camera).inverse().to_rotation_matrix().into_inner();
        (turned, position + world_from_body * self.position)
    }
}

impl Sight {
    /// The normal matrix N of this observation.
    pub(super) fn normal(&self) -> Matrix3<f64> {
        self.jacobian.transpose() * self.jacobian * self.weight
    }

    /// Linearises at a keyframe and a landmark. Returns `false` if the landmark would be behind the camera.
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

    /// Linearises at a landmark of the window, and weighs it by its residual there. Returns `false` if the landmark would be behind
    /// the camera.
    pub(super) fn relinearise<F, S: States, const N: usize>(
        &mut self,
        camera: &Camera,
        kernel: Kernel,
        window: &Window<F, N>,
        first: u64,
        point: &Vector3<f64>,
    ) -> bool {
        let Some(keyframe) = window.get((self.serial - first) as usize) else { return false };
        let Some((_, residual)) = self.estimated::<F, S, N>(camera, keyframe, point) else { return false };
        self.weight = kernel.weight(residual.norm_squared());
        self.linearise(camera, keyframe, point)
    }

    /// B and the residual at the estimates of keyframe and landmark.
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

    /// Returns it as an observation of a landmark that is an unknown of its own.
    pub(super) fn seen(&self) -> Seen {
        let normal = self.normal();
        let mut tie = [[0.0; POSE]; 3];
        for (i, row) in tie.iter_mut().enumerate() {
            self.write(&normal.row(i).transpose(), row);
        }
        Seen { normal, tie, vector: self.jacobian.transpose() * self.residual * self.weight }
    }

    /// `share D`.
    fn write(&self, share: &Vector3<f64>, target: &mut [f64]) {
        let turned = share.cross(&self.arm);
        for i in 0..3 {
            target[i] = -share[i];
            target[3 + i] = turned[i];
        }
    }

    /// The information on its pose if the landmark stays at its linearisation point.
    pub(super) fn information(&self) -> PoseInformation {
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
