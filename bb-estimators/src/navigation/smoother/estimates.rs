//! What is asked of a smoother: estimates and covariances of its keyframes.

use nalgebra::{Matrix6, SMatrix};

use super::factor::Factor;
use super::filter::FixedLagSmoother;
use super::link::predicted;
use super::matrix::{Square, mirror};
use crate::navigation::state::{Estimate, POSITION, ROTATION, States};

impl<S: States, const N: usize, F: Factor<S, N>> FixedLagSmoother<S, N, F> {
    /// What is estimated of the newest keyframe; none before the start.
    pub fn estimate(&self) -> Option<Estimate<N>> {
        self.window.back().map(|keyframe| keyframe.estimate::<S>())
    }

    /// The estimate at the last sample of the IMU, for an output between keyframes; none before the start.
    pub fn predicted(&self) -> Option<Estimate<N>> {
        let mut estimate = self.estimate()?;
        if self.time_ns > estimate.time_ns {
            estimate = predicted::<S, N>(&estimate, &self.motion, &self.params.sensors);
            estimate.time_ns = self.time_ns;
            estimate.angular_velocity = self.last.angular_velocity - estimate.gyroscope_bias;
            estimate.specific_force = self.last.specific_force - estimate.accelerometer_bias;
        }
        Some(estimate)
    }

    /// Covariance of the newest keyframe, `N × N`, in the order of [`POSITION`] to
    /// [`GYROSCOPE_BIAS`](crate::navigation::GYROSCOPE_BIAS) and then of the optional states, as of the last update. None
    /// before the first, and where something is not known at all.
    pub fn covariance(&self) -> Option<SMatrix<f64, N, N>> {
        self.newest_covariance().map(|covariance| SMatrix::from_fn(|i, j| covariance[i][j]))
    }

    fn newest_covariance(&self) -> Option<Square<N>> {
        let root = &self.window.back()?.pivot.root;
        let is_eliminated = self.dirty >= self.window.len() && root.is_regular();
        is_eliminated.then(|| {
            let mut inverse = root.inverse();
            mirror(&mut inverse);
            inverse
        })
    }

    /// Covariance of the pose of the newest keyframe: position error in the world, m², then rotation error in the world,
    /// rad². None as [`covariance`](Self::covariance).
    pub fn pose_covariance(&self) -> Option<Matrix6<f64>> {
        let covariance = self.newest_covariance()?;
        let index = |i: usize| if i < 3 { POSITION + i } else { ROTATION + i - 3 };
        Some(Matrix6::from_fn(|i, j| covariance[index(i)][index(j)]))
    }

    /// The keyframes of the window by their ids, the oldest first.
    pub fn keyframes(&self) -> impl DoubleEndedIterator<Item = u64> + ExactSizeIterator {
        self.window.iter().map(|keyframe| keyframe.id)
    }

    /// What is estimated of a keyframe of the window, from all that was measured before and after it, as of the last
    /// update.
    pub fn smoothed(&mut self, id: u64) -> Option<Estimate<N>> {
        let index = self.window.iter().position(|keyframe| keyframe.id == id)?;
        if index < self.exact_from && self.dirty >= self.window.len() {
            self.solve_back(self.exact_from, index);
            self.exact_from = index;
        }
        self.window.get(index).map(|keyframe| keyframe.estimate::<S>())
    }

    /// Covariance of a keyframe of the window, as [`covariance`](Self::covariance). It takes as many steps back as there are
    /// keyframes after it.
    pub fn smoothed_covariance(&self, id: u64) -> Option<SMatrix<f64, N, N>> {
        let index = self.window.iter().position(|keyframe| keyframe.id == id)?;
        let covariance = self.covariance_at(index)?;
        Some(SMatrix::from_fn(|i, j| covariance[i][j]))
    }

    pub(super) fn covariance_at(&self, index: usize) -> Option<Square<N>> {
        let mut covariance = self.newest_covariance()?;
        for index in (index..self.window.len() - 1).rev() {
            let (keyframe, next) = (self.window.get(index)?, self.window.get(index + 1)?);
            covariance = keyframe.pivot.covariance_back(&next.link, &covariance);
        }
        Some(covariance)
    }
}
