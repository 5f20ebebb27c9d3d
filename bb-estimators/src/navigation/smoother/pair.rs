//! A factor on two keyframes that are not neighbours, and its linearisation.

use super::coupling::{POSE, place};
use super::kernel::Kernel;
use super::keyframe::{Held, Keyframe};
use crate::navigation::factor::{Factor, MOST_ROWS, Rows};
use crate::navigation::numbers::REWEIGHED_FACTOR;
use crate::navigation::refusal::Refusal;
use crate::navigation::state::States;

/// A factor on two keyframes that are not neighbours.
#[derive(Clone, Debug)]
pub(super) struct Pair<F, const N: usize> {
    held: Held<F>,
    /// The serial numbers of the keyframes.
    pub(super) from: u64,
    pub(super) to: u64,
    /// The versions of their linearisations that it uses.
    versions: (u32, u32),
    count: usize,
    /// The Jacobian by both poses, the earlier first, and the residual, with the weights.
    rows: [[f64; 2 * POSE]; MOST_ROWS],
    residual: [f64; MOST_ROWS],
}

impl<F, const N: usize> Pair<F, N> {
    /// Creates one that is not linearised.
    pub(super) fn new(held: Held<F>, (from, to): (u64, u64)) -> Self {
        let (rows, residual) = ([[0.0; 2 * POSE]; MOST_ROWS], [0.0; MOST_ROWS]);
        Self { held, from, to, versions: (0, 0), count: 0, rows, residual }
    }

    /// Linearises it. One that was linearised when it was added, and cannot be now, contributes nothing.
    pub(super) fn linearise<S: States>(&mut self, from: &Keyframe<F, N>, to: &Keyframe<F, N>)
    where
        F: Factor<S, N>,
    {
        self.versions = (from.version, to.version);
        let mut rows = Rows::new();
        self.count = match linearised::<F, S, N>(&self.held.factor, from, to, &mut rows) {
            Ok(()) => rows.count,
            Err(_) => 0,
        };
        rows.weigh(self.held.trust);
        self.write(&rows);
        if self.held.kernel != Kernel::Squares {
            self.held.weight = self.held.kernel.weight(self.distance(from, to));
            rows.weigh(self.held.weight);
            self.write(&rows);
        }
    }

    /// The rows and the residual.
    pub(super) fn rows(&self) -> (&[[f64; 2 * POSE]], &[f64]) {
        (&self.rows[..self.count], &self.residual[..self.count])
    }

    fn write(&mut self, rows: &Rows<N>) {
        self.residual = rows.residual;
        for (row, target) in self.rows.iter_mut().enumerate() {
            for i in 0..POSE {
                target[i] = rows.previous[row][place(i)];
                target[POSE + i] = rows.at[row][place(i)];
            }
        }
    }

    /// The squared norm of the whitened residual, with the weights, at the current estimate.
    fn distance(&self, from: &Keyframe<F, N>, to: &Keyframe<F, N>) -> f64 {
        let rows = self.rows.iter().zip(&self.residual).take(self.count);
        rows.map(|(row, residual)| {
            let of = |i: usize| row[i] * from.correction[place(i)] + row[POSE + i] * to.correction[place(i)];
            let off = residual - (0..POSE).map(of).sum::<f64>();
            off * off
        })
        .sum()
    }

    /// Returns whether a keyframe was linearised elsewhere since, or the kernel now gives another weight.
    pub(super) fn is_stale(&self, from: &Keyframe<F, N>, to: &Keyframe<F, N>) -> bool {
        let Held { kernel, weight, .. } = self.held;
        let weighs_otherwise = || {
            (kernel.weight(self.distance(from, to) / weight.max(f64::MIN_POSITIVE)) - weight).abs()
                > REWEIGHED_FACTOR
        };
        self.versions != (from.version, to.version) || (kernel != Kernel::Squares && weighs_otherwise())
    }
}

/// Linearises such a factor, if it concerns nothing but poses.
pub(super) fn linearised<F: Factor<S, N>, S: States, const N: usize>(
    factor: &F,
    from: &Keyframe<F, N>,
    to: &Keyframe<F, N>,
    rows: &mut Rows<N>,
) -> Result<(), Refusal> {
    rows.fill(true, |rows| factor.linearise(Some(&from.point), &to.point, rows))?;
    // Only poses are coupled.
    let is_of_pose =
        |row: &[f64; N]| row.iter().enumerate().all(|(i, x)| *x == 0.0 || (0..POSE).any(|j| place(j) == i));
    let mut all = rows.previous[..rows.count].iter().chain(&rows.at[..rows.count]);
    if all.all(is_of_pose) { Ok(()) } else { Err(Refusal::NotAdjacent { id: from.id }) }
}
