//! Estimates and covariances of the keyframes.

use nalgebra::{Matrix3, Matrix6, SMatrix};

use super::coupling::{Coupling, POSE, place};
use super::filter::FixedLagSmoother;
use super::link::predicted;
use super::matrix::{Square, axpy, dot, mirror};
use super::scratch::Scratch;
use crate::navigation::factor::{Factor, MOST_ROWS, NavigationFactor, Rows};
use crate::navigation::measurement::RelativePose;
use crate::navigation::state::{Estimate, POSITION, ROTATION, States};

impl<S: States, const N: usize, F: Factor<S, N>> FixedLagSmoother<S, N, F> {
    /// The estimate of the newest keyframe; `None` before the start.
    pub fn estimate(&self) -> Option<Estimate<N>> {
        self.window.back().map(|keyframe| keyframe.estimate::<S>())
    }

    /// The estimate at the last IMU sample, for an output between keyframes; `None` before the start.
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

    /// Covariance of the newest keyframe, `N × N`, as of the last update. The order is [`POSITION`] to
    /// [`GYROSCOPE_BIAS`](crate::navigation::GYROSCOPE_BIAS), then the optional states. `None` before the first update,
    /// or if a direction is not determined at all.
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

    /// Covariance of the pose of the newest keyframe: position error in the world, m², then rotation error in the
    /// world, rad². `None` in the same cases as [`covariance`](Self::covariance).
    pub fn pose_covariance(&self) -> Option<Matrix6<f64>> {
        let covariance = self.newest_covariance()?;
        let index = |i: usize| if i < 3 { POSITION + i } else { ROTATION + i - 3 };
        Some(Matrix6::from_fn(|i, j| covariance[index(i)][index(j)]))
    }

    /// The ids of the keyframes in the window, oldest first.
    pub fn keyframes(&self) -> impl DoubleEndedIterator<Item = u64> + ExactSizeIterator {
        self.window.iter().map(|keyframe| keyframe.id)
    }

    /// The estimate of a keyframe of the window from all measurements before and after it, as of the last update.
    pub fn smoothed(&mut self, id: u64) -> Option<Estimate<N>> {
        let index = self.window.iter().position(|keyframe| keyframe.id == id)?;
        if index < self.exact_from && self.dirty >= self.window.len() {
            self.solve_back(self.exact_from, index);
            self.exact_from = index;
        }
        self.window.get(index).map(|keyframe| keyframe.estimate::<S>())
    }

    /// Covariance of a keyframe of the window, in the same form as [`covariance`](Self::covariance). The cost is one backward
    /// step for each later keyframe.
    pub fn smoothed_covariance(&self, id: u64) -> Option<SMatrix<f64, N, N>> {
        let index = self.window.iter().position(|keyframe| keyframe.id == id)?;
        let covariance = if self.is_tied() {
            self.covariance_tied(index, &mut Scratch::new(self.window.len()))?
        } else {
            self.covariance_at(index)?
        };
        Some(SMatrix::from_fn(|i, j| covariance[i][j]))
    }

    /// The pose of a keyframe of the window relative to an earlier one, as of the last update, with the covariances that it has given all
    /// measurements. `None` if the window has no such pair, or if a direction is not determined at all.
    pub fn relative(&mut self, from: u64, to: u64) -> Option<RelativePose> {
        let index = |id: u64| self.window.iter().position(|keyframe| keyframe.id == id);
        let (before, after) = index(from).zip(index(to)).filter(|(before, after)| before < after)?;
        self.newest_covariance()?;
        let (earlier, later) = (self.smoothed(from)?, self.smoothed(to)?);
        let back = earlier.world_from_body.inverse();
        let translation = back * (later.position - earlier.position);
        let unit = (translation, 1.0);
        let pose = RelativePose::new(from, unit, (back * later.world_from_body, 1.0));
        let mut rows = Rows::new();
        Factor::<S, N>::linearise(&NavigationFactor::Between(pose), Some(&earlier), &later, &mut rows).ok()?;
        let covariance = self.pair_covariance((before, after), &rows)?;
        let to_body = later.rotation().transpose();
        let [translation_covariance, rotation_covariance] = [0, 3].map(|first| {
            let of = |i: usize, j: usize| covariance[first + i.max(j)][first + i.min(j)];
            to_body * Matrix3::from_fn(of) * to_body.transpose()
        });
        Some(RelativePose { translation_covariance, rotation_covariance, ..pose })
    }

    /// Returns the covariance of a keyframe, without allocating.
    pub(super) fn covariance_now(&mut self, index: usize) -> Option<Square<N>> {
        if !self.is_tied() {
            return self.covariance_at(index);
        }
        let mut scratch = core::mem::take(&mut self.scratch);
        let covariance = self.covariance_tied(index, &mut scratch);
        self.scratch = scratch;
        covariance
    }

    /// The covariance where keyframes are coupled that are not neighbours: computed column by column as the response to an impulse.
    fn covariance_tied(&self, index: usize, scratch: &mut Scratch<N>) -> Option<Square<N>> {
        let newest = self.newest_covariance()?;
        if index + 1 == self.window.len() {
            return Some(newest);
        }
        let mut covariance = [[0.0; N]; N];
        for column in 0..N {
            let mut impulse = [0.0; N];
            impulse[column] = 1.0;
            self.respond((index, impulse), (index + 1, &[0.0; N]), scratch)?;
            let response = scratch.corrections.get(index)?;
            (0..N).for_each(|row| covariance[row][column] = response[row]);
        }
        Some(covariance)
    }

    /// The covariance that the uncertainty of a keyframe and an earlier one gives a factor on both, on and below the diagonal.
    pub(super) fn pair_covariance(
        &mut self,
        (before, index): (usize, usize),
        factor: &Rows<N>,
    ) -> Option<[[f64; MOST_ROWS]; MOST_ROWS]> {
        let mut scratch = core::mem::take(&mut self.scratch);
        let covariance = self.pair_covariance_in((before, index), factor, &mut scratch);
        self.scratch = scratch;
        covariance
    }

    fn pair_covariance_in(
        &self,
        (before, index): (usize, usize),
        factor: &Rows<N>,
        scratch: &mut Scratch<N>,
    ) -> Option<[[f64; MOST_ROWS]; MOST_ROWS]> {
        let mut covariance = [[0.0; MOST_ROWS]; MOST_ROWS];
        for (i, sums) in covariance.iter_mut().enumerate().take(factor.count) {
            self.respond((before, factor.previous[i]), (index, &factor.at[i]), scratch)?;
            let (earlier, later) = (scratch.corrections.get(before)?, scratch.corrections.get(index)?);
            for (j, sum) in sums.iter_mut().enumerate().take(i + 1) {
                *sum = dot(&factor.previous[j], earlier) + dot(&factor.at[j], later);
            }
        }
        Some(covariance)
    }

    /// The corrections of a keyframe and of later ones if the only information vectors are these, at that keyframe and at a later one.
    fn respond(
        &self,
        (index, impulse): (usize, [f64; N]),
        (later, at_later): (usize, &[f64; N]),
        scratch: &mut Scratch<N>,
    ) -> Option<()> {
        let coupling = self.coupling();
        let last = self.window.len() - 1;
        let Scratch { means, corrections, poses } = scratch;
        poses.fill(0.0);
        let mut arrived = impulse;
        for k in index..last {
            let (keyframe, next) = (self.window.get(k)?, self.window.get(k + 1)?);
            let response = keyframe.pivot.respond(&next.link, &arrived);
            *means.get_mut(k)? = response.mean;
            if let Some(coupling) = coupling {
                coupling.push(k, &response.at, poses.get_mut(POSE * (k + 1)..POSE * (last + 1))?);
            }
            arrived = response.next;
            if k + 1 == later {
                axpy(&mut arrived, 1.0, at_later);
            }
            for i in 0..POSE {
                arrived[place(i)] += poses[POSE * (k + 1) + i];
            }
        }
        let root = &self.window.get(last)?.pivot.root;
        *corrections.get_mut(last)? = root.solve(&root.solve_transposed(&arrived));
        for k in (index..last).rev() {
            let (keyframe, next) = (self.window.get(k)?, self.window.get(k + 1)?);
            let later = corrections.get(k + 1..=last)?.iter();
            let pull = coupling.map_or([0.0; N], |coupling| coupling.pull(k, later));
            let correction = keyframe.pivot.respond_back(means.get(k)?, &next.link, corrections.get(k + 1)?, &pull);
            *corrections.get_mut(k)? = correction;
        }
        Some(())
    }

    /// The coupling of keyframes that are not neighbours; `None` if they form a chain.
    pub(super) fn coupling(&self) -> Option<&Coupling<N>> {
        let coupling = self.landmarks.as_ref().map(|landmarks| &landmarks.coupling);
        coupling.filter(|coupling| coupling.is_tied())
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
