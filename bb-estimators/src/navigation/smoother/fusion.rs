//! Gates and adds measurements at any keyframe of the window.

use super::elimination::{Known, judge, judge_pair, judge_with};
use super::filter::FixedLagSmoother;
use super::kernel::Kernel;
use super::keyframe::{Held, Prior};
use crate::navigation::factor::Factor;
use crate::navigation::factor::Rows;
use crate::navigation::fused::{Fused, Judged};
use crate::navigation::refusal::Refusal;
use crate::navigation::state::States;
use crate::navigation::stream::{Gate, Stream};

impl<S: States, const N: usize, F: Factor<S, N>> FixedLagSmoother<S, N, F> {
    /// Adds a measurement at a keyframe of the window. Measurements may arrive in any order.
    ///
    /// `stream` is the stream of the sensor: its gate decides, and its counts and statistics record the result. A window
    /// that is wrong refuses what is right; [`adopt`](Self::adopt) restarts it.
    ///
    /// # Errors
    ///
    /// [`Refusal`], which the stream has counted; the smoother is then unchanged. [`Refusal::NoKeyframe`] if the
    /// keyframe, or the one that a relative pose refers to, has left the window; [`Refusal::NotAdjacent`] if the latter is not the
    /// previous keyframe, and the factor concerns more than the two poses. The first factor on two keyframes that are not neighbours
    /// allocates what couples them, and a keyframe then costs more while they are in the window.
    pub fn add(&mut self, stream: &mut Stream, id: u64, factor: impl Into<F>) -> Result<Fused, Refusal> {
        self.add_robust(stream, id, factor, Kernel::Squares)
    }

    /// Like [`add`](Self::add), with a robust kernel. The weight is updated as the estimate of the window changes.
    ///
    /// # Errors
    ///
    /// Those of [`add`](Self::add).
    pub fn add_robust(
        &mut self,
        stream: &mut Stream,
        id: u64,
        factor: impl Into<F>,
        kernel: Kernel,
    ) -> Result<Fused, Refusal> {
        let result = self.fuse(stream, id, factor.into(), kernel);
        stream.count(&result);
        result
    }

    fn fuse(&mut self, stream: &Stream, id: u64, factor: F, kernel: Kernel) -> Result<Fused, Refusal> {
        if self.window.is_empty() {
            return Err(Refusal::NotStarted);
        }
        let missing = Refusal::NoKeyframe { id };
        // Ids increase, but not always by one.
        let index = self.window.iter().rposition(|keyframe| keyframe.id == id).ok_or(missing)?;
        if let Some(landmarks) = &mut self.landmarks {
            landmarks.judging.forget();
        }
        let trust = 1.0 / stream.params().variance_factor;
        let mut rows = Rows::new();
        let keyframe = self.window.get(index).ok_or(missing)?;
        if keyframe.factors.len() >= self.params.factors {
            return Err(Refusal::Full { id });
        }
        let before = index.checked_sub(1).and_then(|before| self.window.get(before));
        if let Some(id) = factor.previous()
            && before.is_none_or(|before| before.id != id)
        {
            return self.fuse_pair(stream, (id, index), factor, kernel);
        }
        keyframe.rows::<S>(&factor, before.map(|before| &**before), &mut rows)?;
        rows.weigh(trust);
        let ties = factor.previous().is_some();
        let judged = self.judged(index, &rows, ties).ok_or(Refusal::NonFinite)?;
        let fused = stream.weigh(&judged, rows.count, Gate::Closed)?;
        let is_robust = kernel != Kernel::Squares;
        let held = Held { factor, kernel, trust: trust * fused.weight, weight: 1.0 };
        if let Some(keyframe) = self.window.get_mut(index) {
            keyframe.factors.push(held);
            keyframe.is_robust |= is_robust;
            if is_robust {
                self.linearise(index);
            } else {
                rows.weigh(fused.weight);
                if ties {
                    keyframe.link.add(&rows);
                    if let Some(landmarks) = &mut self.landmarks {
                        landmarks.coupling.relink(index);
                    }
                } else {
                    keyframe.own.add_rows(&rows.at[..fused.dimension], &rows.residual[..fused.dimension]);
                }
            }
        }
        self.dirty = self.dirty.min(index);
        Ok(fused)
    }

    /// Compares a factor with the current estimate. Only the correction of the newest keyframe is recomputed; the
    /// others are as of the last update.
    fn judged(&mut self, index: usize, rows: &Rows<N>, ties: bool) -> Option<Judged> {
        self.eliminate(self.window.len());
        let is_newest = index + 1 == self.window.len();
        let newest = self.window.back_mut()?;
        newest.correction = newest.pivot.newest();
        let correction = if is_newest { newest.correction } else { self.correction_at(index)? };
        if ties && self.landmarks.as_ref().is_some_and(|landmarks| landmarks.coupling.spans(index)) {
            let earlier = self.back(index.checked_sub(1)?, &correction)?;
            let covariance = self.pair_covariance((index - 1, index), rows)?;
            return judge_with(rows, (&earlier, &correction), covariance);
        }
        let covariance = if is_newest { None } else { Some(self.covariance_now(index)?) };
        let keyframe = self.window.get(index)?;
        let known = covariance.as_ref().map_or(Known::Newest(&keyframe.pivot.root), Known::Other);
        if !ties {
            return judge(rows, &correction, &known);
        }
        let before = self.window.get(index.checked_sub(1)?)?;
        let earlier = self.back(index - 1, &correction)?;
        judge_pair(rows, &before.pivot, &keyframe.link, (&earlier, &correction), &known)
    }

    /// The correction of a keyframe if it were solved now.
    pub(super) fn correction_at(&mut self, index: usize) -> Option<[f64; N]> {
        if self.is_tied() {
            self.solve_all();
            return Some(self.window.get(index)?.correction);
        }
        let mut correction = self.window.back()?.correction;
        for index in (index..self.window.len() - 1).rev() {
            let (keyframe, next) = (self.window.get(index)?, self.window.get(index + 1)?);
            correction = keyframe.pivot.back(&next.link, &correction);
        }
        Some(correction)
    }

    /// Restarts the window at its newest keyframe, with its covariance. The window must be solved.
    #[cold]
    pub(super) fn collapse(&mut self) {
        let Some(keyframe) = self.window.back() else { return };
        let newest = self.window.len() - 1;
        let (id, point) = (keyframe.id, keyframe.estimate::<S>());
        let mut information = keyframe.known();
        information.vector = [0.0; N];
        self.marginalised = self.marginalised.wrapping_add(newest as u64);
        self.spare.extend(self.window.drain(..));
        let motion = self.motion;
        let time_ns = self.time_ns;
        self.begin(id, point, Prior { information, mean: Some(point) });
        (self.motion, self.time_ns) = (motion, time_ns);
    }
}
