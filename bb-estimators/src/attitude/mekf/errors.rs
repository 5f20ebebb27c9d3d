//! The error state: its mean, its covariance, and the two operations of a Kalman filter.

use core::cmp::Ordering;

use nalgebra::Matrix3;

use super::states::{BIAS, CALIBRATION, FORCE_LATENCY, ROTATION, STATES, VELOCITY};
use super::window::Window;
use crate::attitude::Real;

/// Bias and calibration, which the rotation error integrates.
const GYROSCOPE: usize = CALIBRATION + 9 - BIAS;

/// A variance never falls below this fraction of its value after one update: rounding cannot make it negative.
const ROUNDING: f64 = 1e-6;

/// Mean and covariance of the error state. The covariance is kept symmetric to the last bit.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Errors<T> {
    pub(super) mean: [T; STATES],
    covariance: [[T; STATES]; STATES],
}

/// Variances that grow with time, per second or per window.
#[derive(Clone, Copy, Debug)]
pub(super) struct ProcessNoise<T> {
    /// rad².
    pub(super) rotation: T,
    /// (rad/s)².
    pub(super) bias: T,
    /// (m/s)².
    pub(super) velocity: T,
}

impl<T: Real> Errors<T> {
    /// Zero mean and covariance.
    pub(super) fn new() -> Self {
        Self { mean: [T::ZERO; STATES], covariance: [[T::ZERO; STATES]; STATES] }
    }

    /// Resets `COUNT` states from `first` on, and their correlations with all others.
    pub(super) fn forget<const COUNT: usize>(&mut self, first: usize, variance: T) {
        for i in first..first + COUNT {
            for j in 0..STATES {
                self.covariance[i][j] = T::ZERO;
                self.covariance[j][i] = T::ZERO;
            }
            self.covariance[i][i] = variance;
        }
    }

    /// Increases a state's variance.
    pub(super) fn doubt(&mut self, state: usize, variance: T) {
        self.covariance[state][state] += variance;
    }

    pub(super) fn variance(&self, state: usize) -> T {
        self.covariance[state][state]
    }

    /// Covariance of the three states from `first` on; of the rotation error in world axes, rad².
    pub(super) fn block(&self, first: usize) -> Matrix3<T> {
        Matrix3::from_fn(|i, k| self.covariance[first + i][first + k])
    }

    /// Whether every mean and variance is usable.
    pub(super) fn are_sane(&self) -> bool {
        let variances = (0..STATES).all(|i| (T::ZERO..T::of(1e12)).contains(&self.covariance[i][i]));
        variances && self.mean.iter().all(|mean| mean.abs() < T::of(1e9))
    }

    /// Propagates the errors over a window: `x ← Φ x`, `P ← Φ P Φᵀ + Q`.
    ///
    /// With F the integral of the specific force in the world frame, R that of the rotation and W that of
    /// rotation times angular velocity, all of them of the window:
    ///
    /// * velocity: `v ← v + F + θ × F - τ F'`, horizontally, with F' the integral of rotation times ω × f,
    /// * rotation: `θ ← θ - R δb - W δE`.
    pub(super) fn propagate(&mut self, window: &Window<T>, noise: &ProcessNoise<T>) {
        let force = &window.force;
        let turned = [[T::ZERO, force.z, -force.y], [-force.z, T::ZERO, force.x]];
        let lagged = [[-window.force_rate.x], [-window.force_rate.y]];
        let integrated = window.gyroscope_integrals();
        self.mix::<2, 3>(VELOCITY, ROTATION, &turned);
        self.mix::<2, 1>(VELOCITY, FORCE_LATENCY, &lagged);
        self.mean[VELOCITY] += force.x;
        self.mean[VELOCITY + 1] += force.y;
        self.mix::<3, GYROSCOPE>(ROTATION, BIAS, &integrated);
        for i in 0..3 {
            self.covariance[ROTATION + i][ROTATION + i] += noise.rotation;
            self.covariance[BIAS + i][BIAS + i] += noise.bias;
        }
        for i in 0..2 {
            self.covariance[VELOCITY + i][VELOCITY + i] += noise.velocity;
        }
    }

    /// Adds `factor` times the states from `source` on to those from `target` on; the two do not overlap.
    fn mix<const ROWS: usize, const COLUMNS: usize>(
        &mut self,
        target: usize,
        source: usize,
        factor: &[[T; COLUMNS]; ROWS],
    ) {
        for (i, factor) in factor.iter().enumerate() {
            let mut row = self.covariance[target + i];
            for (k, factor) in factor.iter().enumerate() {
                self.mean[target + i] += *factor * self.mean[source + k];
                for (sum, value) in row.iter_mut().zip(&self.covariance[source + k]) {
                    *sum += *factor * *value;
                }
            }
            self.covariance[target + i] = row;
        }
        // So far the rows of Φ P. The block on the diagonal is multiplied by Φᵀ as well; the other columns mirror the
        // rows.
        for i in 0..ROWS {
            let row = self.covariance[target + i];
            for (j, factor) in factor.iter().enumerate().skip(i) {
                let sum: T = factor.iter().zip(&row[source..]).map(|(factor, value)| *factor * *value).sum();
                self.covariance[target + i][target + j] = row[target + j] + sum;
            }
        }
        for i in 0..ROWS {
            for j in 0..STATES {
                if (target..target + i).contains(&j) {
                    self.covariance[target + i][j] = self.covariance[j][target + i];
                } else if !(target..target + ROWS).contains(&j) {
                    self.covariance[j][target + i] = self.covariance[target + i][j];
                }
            }
        }
    }

    /// Rotates the world about the vertical by an angle given by cosine and sine.
    pub(super) fn turn_heading(&mut self, [cos, sin]: [T; 2]) {
        let turned = |x: T, y: T| (cos * x - sin * y, sin * x + cos * y);
        for first in [ROTATION, VELOCITY] {
            (self.mean[first], self.mean[first + 1]) = turned(self.mean[first], self.mean[first + 1]);
            for j in 0..STATES {
                let (x, y) = turned(self.covariance[first][j], self.covariance[first + 1][j]);
                self.covariance[first][j] = x;
                self.covariance[first + 1][j] = y;
            }
            for row in &mut self.covariance {
                (row[first], row[first + 1]) = turned(row[first], row[first + 1]);
            }
        }
        // The two halves were rounded differently.
        for i in 0..STATES {
            for j in 0..i {
                self.covariance[i][j] = self.covariance[j][i];
            }
        }
    }

    /// One scalar measurement: `measured` equals the states times `observation`, up to `variance`.
    pub(super) fn update<const COUNT: usize>(
        &mut self,
        observation: [(usize, T); COUNT],
        measured: T,
        variance: T,
    ) {
        let mut gain = [T::ZERO; STATES];
        let mut expected = T::ZERO;
        for (state, factor) in observation {
            expected += factor * self.mean[state];
            for (gain, value) in gain.iter_mut().zip(&self.covariance[state]) {
                *gain += factor * *value;
            }
        }
        let total: T = variance + observation.iter().map(|(state, factor)| *factor * gain[*state]).sum::<T>();
        // Also rejects NaN.
        if !matches!(total.partial_cmp(&T::ZERO), Some(Ordering::Greater)) {
            return;
        }
        let scale = T::ONE / total;
        let step = (measured - expected) * scale;
        for i in 0..STATES {
            self.mean[i] += gain[i] * step;
            let least = self.covariance[i][i] * T::of(ROUNDING);
            for j in 0..STATES {
                // In this order, both halves round alike.
                self.covariance[i][j] -= (gain[i] * gain[j]) * scale;
            }
            self.covariance[i][i] = self.covariance[i][i].max(least);
        }
    }
}
