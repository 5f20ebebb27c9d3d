//! Elimination in chronological order against a batch solution, on random problems.

#![allow(clippy::needless_range_loop, reason = "the indices are those of the equations")]

use bb_tests::laws;
use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use proptest::prelude::*;

use super::super::elimination::Pivot;
use super::super::link::{Information, Link};
use super::super::matrix::{Root, Square, mirror};
use crate::navigation::factor::Rows;
use crate::navigation::noise::Noise;

const N: usize = 5;
const D: usize = 3;

fn random(noise: &mut Noise) -> SMatrix<f64, N, N> {
    SMatrix::from_fn(|_, _| noise.next())
}

fn square(matrix: &SMatrix<f64, N, N>) -> Square<N> {
    core::array::from_fn(|i| core::array::from_fn(|j| matrix[(i, j)]))
}

fn numbers(noise: &mut Noise) -> SVector<f64, N> {
    SVector::from_fn(|_, _| noise.next())
}

/// A problem in two forms: as the smoother holds it, and as one system of normal equations.
struct Problem {
    own: Vec<Information<N>>,
    links: Vec<Link<N>>,
    matrix: DMatrix<f64>,
    vector: DVector<f64>,
}

impl Problem {
    /// `stiffness` scales the noise between keyframes.
    fn new(seed: u64, keyframes: usize, stiffness: f64) -> Self {
        let mut noise = Noise::new(seed);
        let size = N * keyframes;
        let mut all = Self {
            own: Vec::new(),
            links: Vec::new(),
            matrix: DMatrix::zeros(size, size),
            vector: DVector::zeros(size),
        };
        for k in 0..keyframes {
            // Information on one keyframe alone may have any rank; the first keyframe is known.
            let root = random(&mut noise);
            let of_rank =
                SMatrix::<f64, N, N>::from_fn(|i, j| if k == 0 || i < k % 3 { root[(i, j)] } else { 0.0 });
            let known = of_rank.transpose() * of_rank + SMatrix::identity() * if k == 0 { 0.5 } else { 0.0 };
            let mean = numbers(&mut noise);
            let vector = known * mean;
            all.own.push(Information { matrix: square(&known), vector: vector.into() });
            all.add(k * N, &known, &vector);
            if k > 0 {
                all.link(&mut noise, k, stiffness);
            }
        }
        all
    }

    fn link(&mut self, noise: &mut Noise, k: usize, stiffness: f64) {
        let back = random(noise) * 0.3 + SMatrix::identity();
        let offset = numbers(noise);
        let root = random(noise);
        let covariance = (root * root.transpose() + SMatrix::identity() * 0.1) * stiffness;
        let mut link = Link {
            back: square(&back),
            offset: offset.into(),
            noise: square(&covariance),
            information: Information::none(),
        };
        // δ_before - G δ = g + ν
        let inverse = covariance.try_inverse().unwrap();
        let mut rows = DMatrix::zeros(N, 2 * N);
        rows.view_mut((0, 0), (N, N)).fill_with_identity();
        rows.view_mut((0, N), (N, N)).copy_from(&-back);
        let weighted = rows.transpose() * inverse;
        let at = (k - 1) * N;
        let mut view = self.matrix.view_mut((at, at), (2 * N, 2 * N));
        view += &weighted * &rows;
        let mut view = self.vector.rows_mut(at, 2 * N);
        view += &weighted * offset;
        // Factors on both keyframes.
        for _ in 0..2 {
            let mut factor = Rows::new();
            let jacobians: [SMatrix<f64, D, N>; 2] = [(); 2].map(|()| SMatrix::from_fn(|_, _| noise.next()));
            let [previous, this] = jacobians.map(|matrix| -> [[f64; N]; D] {
                core::array::from_fn(|i| core::array::from_fn(|j| matrix[(i, j)]))
            });
            let residual = SVector::<f64, D>::from_fn(|_, _| noise.next());
            let root = SMatrix::<f64, D, D>::from_fn(|_, _| noise.next());
            let covariance = root * root.transpose() + SMatrix::identity() * 0.2;
            factor.set(residual.into(), Some(&previous), &this, &covariance).unwrap();
            link.add(&factor);
            let mut rows = DMatrix::zeros(D, 2 * N);
            rows.view_mut((0, 0), (D, N)).copy_from(&jacobians[0]);
            rows.view_mut((0, N), (D, N)).copy_from(&jacobians[1]);
            let weighted = rows.transpose() * covariance.try_inverse().unwrap();
            let mut view = self.matrix.view_mut((at, at), (2 * N, 2 * N));
            view += &weighted * &rows;
            let mut view = self.vector.rows_mut(at, 2 * N);
            view += &weighted * residual;
        }
        self.links.push(link);
    }

    fn add(&mut self, at: usize, matrix: &SMatrix<f64, N, N>, vector: &SVector<f64, N>) {
        let mut view = self.matrix.view_mut((at, at), (N, N));
        view += matrix;
        let mut view = self.vector.rows_mut(at, N);
        view += vector;
    }

    fn pivots(&self) -> Vec<Pivot<N>> {
        let mut pivots = vec![Pivot::none(); self.own.len()];
        pivots[0].take(&self.own[0]);
        for (k, link) in self.links.iter().enumerate() {
            let mut known = self.own[k + 1];
            known.add(&pivots[k].eliminate(link));
            pivots[k + 1].take(&known);
        }
        pivots
    }
}

fn agrees(numbers: impl Iterator<Item = (f64, f64)>, what: &str) -> Result<(), TestCaseError> {
    let pairs: Vec<_> = numbers.collect();
    let scale = pairs.iter().map(|(_, batch)| batch.abs()).fold(0.0, f64::max);
    for (here, batch) in pairs {
        prop_assert!((here - batch).abs() <= 1e-9 * scale, "{what}: {here}, not {batch} (of {scale})");
    }
    Ok(())
}

laws! {
    #[test]
    fn it_is_the_batch(seed in any::<u64>(), keyframes in 1_usize..9, stiffness in -4.0..4.0_f64) {
        let problem = Problem::new(seed | 1, keyframes, 10_f64.powf(stiffness));
        let covariance = problem.matrix.clone().cholesky().unwrap().inverse();
        let solution = &covariance * &problem.vector;
        let pivots = problem.pivots();
        let last = keyframes - 1;
        let mut mean = pivots[last].newest();
        let mut variance = pivots[last].root.inverse();
        mirror(&mut variance);
        for k in (0..keyframes).rev() {
            if k < last {
                mean = pivots[k].back(&problem.links[k], &mean);
                variance = pivots[k].covariance_back(&problem.links[k], &variance);
            }
            let at = k * N;
            agrees((0..N).map(|i| (mean[i], solution[at + i])), "mean")?;
            let entries = (0..N * N).map(|e| (e / N, e % N));
            agrees(entries.map(|(i, j)| (variance[i][j], covariance[(at + i, at + j)])), "covariance")?;
        }
    }
}

/// The information passed to the next keyframe loses no digits, however small or large the noise is relative to what is
/// known. Compared with the same formula in exact arithmetic, in one dimension.
#[test]
fn nothing_cancels() {
    for (known, noise) in [(1.0, 1e-16), (1e-12, 1e-9), (1e14, 1e-20), (1e-8, 1e8), (1e12, 1.0), (1e12, 1e12)] {
        let mut pivot = Pivot::<1>::none();
        pivot.take(&Information { matrix: [[known]], vector: [known * 3.0] });
        let link = Link { back: [[2.0]], offset: [1.0], noise: [[noise]], information: Information::none() };
        let message = pivot.eliminate(&link);
        let exact = 4.0 / (1.0 / known + noise);
        assert!((message.matrix[0][0] / exact - 1.0).abs() < 1e-14, "{known} {noise}");
        // 3 = 2 δ + 1
        assert!((message.vector[0] / message.matrix[0][0] - 1.0).abs() < 1e-14, "{known} {noise}");
    }
}

/// An undetermined direction is a zero row, not an error.
#[test]
fn a_singular_matrix_has_a_root() {
    let matrix = [[4.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 9.0]];
    let root = Root::of(&matrix);
    assert!(!root.is_regular());
    assert_eq!(root.reciprocal, [0.5, 0.0, 1.0 / 3.0]);
    for i in 0..3 {
        for j in i..3 {
            let product: f64 = (0..3).map(|k| root.upper[k][i] * root.upper[k][j]).sum();
            assert!((product - matrix[i][j]).abs() < 1e-15);
        }
    }
    assert!(!Root::of(&[[f64::NAN]]).is_regular());
    assert!(!Root::of(&[[-1.0]]).is_regular());
}
