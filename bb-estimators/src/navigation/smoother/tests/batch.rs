//! Elimination in chronological order against a batch solution, on random problems.

use bb_tests::laws;
use nalgebra::SMatrix;
use proptest::prelude::*;

use super::super::elimination::Pivot;
use super::super::link::{Information, Link};
use super::super::matrix::{Root, mirror};
use super::dense::{Dense, agrees_at, random};
use crate::navigation::eskf::tests::rows;
use crate::navigation::factor::Rows;
use crate::navigation::noise::Noise;

const N: usize = 5;
const D: usize = 3;

/// Keyframes with links that hold factors on both.
struct Problem {
    own: Vec<Information<N>>,
    links: Vec<Link<N>>,
    dense: Dense<N>,
}

impl Problem {
    /// `stiffness` scales the noise between keyframes.
    fn new(seed: u64, keyframes: usize, stiffness: f64) -> Self {
        let mut noise = Noise::new(seed);
        let mut all = Self { own: Vec::new(), links: Vec::new(), dense: Dense::new(N * keyframes) };
        for k in 0..keyframes {
            all.own.push(all.dense.own(&mut noise, k));
            if k > 0 {
                all.link(&mut noise, k, stiffness);
            }
        }
        all
    }

    fn link(&mut self, noise: &mut Noise, k: usize, stiffness: f64) {
        let mut link = self.dense.link(noise, k, stiffness);
        for _ in 0..2 {
            let mut factor = Rows::new();
            let jacobians: [SMatrix<f64, D, N>; 2] = [(); 2].map(|()| random(noise));
            let [previous, this] = jacobians.map(|jacobian| rows(&jacobian));
            let residual = random::<D, 1>(noise);
            let root = random::<D, D>(noise);
            let covariance = root * root.transpose() + SMatrix::identity() * 0.2;
            factor.set(residual.into(), Some(&previous), &this, &covariance).unwrap();
            link.add(&factor);
            self.dense.pair(k, &jacobians[0], &jacobians[1], &covariance, &residual);
        }
        self.links.push(link);
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

laws! {
    #[test]
    fn it_is_the_batch(seed in any::<u64>(), keyframes in 1_usize..9, stiffness in -4.0..4.0_f64) {
        let problem = Problem::new(seed | 1, keyframes, 10_f64.powf(stiffness));
        let covariance = problem.dense.matrix.clone().cholesky().unwrap().inverse();
        let solution = &covariance * &problem.dense.vector;
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
            agrees_at((&mean, &variance), (&solution, &covariance), k * N, 1e-9)?;
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
    for (i, j) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)] {
        let product: f64 = (0..3).map(|k| root.upper[k][i] * root.upper[k][j]).sum();
        assert!((product - matrix[i][j]).abs() < 1e-15);
    }
    assert!(!Root::of(&[[f64::NAN]]).is_regular() && !Root::of(&[[-1.0]]).is_regular());
}
