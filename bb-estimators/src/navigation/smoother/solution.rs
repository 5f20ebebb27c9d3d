//! The estimate of the window: elimination of what has changed, and linearising again what moved.

use super::factor::Factor;
use super::filter::FixedLagSmoother;
use super::params::SmootherParams;
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{ROTATION, States};

/// Where a correction changes by less than this part of what is linearised again, earlier ones are left as they are until
/// they are asked for.
const SETTLED: f64 = 0.01;

/// What an update did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Updated {
    /// How many keyframes were eliminated, each time they were.
    pub eliminated: usize,
    /// How many keyframes were linearised again, each time they were.
    pub relinearised: usize,
}

impl<S: States, const N: usize, F: Factor<S, N>> FixedLagSmoother<S, N, F> {
    /// Linearises all that concerns a keyframe and the one before.
    pub(super) fn linearise(&mut self, index: usize) {
        let (before, after) = self.window.make_contiguous().split_at_mut(index);
        if let Some(keyframe) = after.first_mut() {
            keyframe.linearise::<S>(before.last().map(|before| &**before), &self.params);
        }
    }

    /// Eliminates what has changed, and all that follows it, up to a keyframe.
    pub(super) fn eliminate(&mut self, end: usize) -> usize {
        let len = self.window.len();
        let end = end.min(len);
        let mut coupling = self.landmarks.as_mut().map(|landmarks| &mut landmarks.coupling);
        coupling = coupling.filter(|coupling| coupling.is_tied());
        // What landmarks say of the poses is not kept as it is between: all is eliminated again, but for the newest alone.
        let end = if coupling.is_some() { len } else { end };
        if coupling.is_some() && self.dirty + 1 < len {
            self.dirty = 0;
        }
        let first = self.dirty;
        let is_full = first == 0;
        if let Some(coupling) = coupling.as_mut().filter(|_| is_full) {
            coupling.begin(len);
        }
        let window = self.window.make_contiguous();
        for index in first..end {
            let (before, after) = window.split_at_mut(index);
            let Some(keyframe) = after.first_mut() else { break };
            if let Some(before) = before.last_mut() {
                keyframe.incoming = before.pivot.eliminate(&keyframe.link);
                if let Some(coupling) = &mut coupling {
                    let carried = before.pivot.carried(&keyframe.link);
                    coupling.fold(index - 1, &carried, &mut keyframe.incoming.matrix);
                    if is_full {
                        coupling.pass(index - 1, len, &carried);
                    }
                }
            }
            if let Some(coupling) = coupling.as_mut().filter(|_| is_full) {
                keyframe.seen = coupling.arrive(index, len);
            }
            keyframe.pivot.take(&keyframe.known());
        }
        self.dirty = self.dirty.max(end);
        self.exact_from = self.exact_from.max(first.min(self.window.len()));
        end.saturating_sub(first)
    }

    /// Corrections from the keyframe before `from`, which has its own, back to `to`.
    pub(super) fn solve_back(&mut self, from: usize, to: usize) {
        for index in (to..from).rev() {
            self.solve_one(index);
        }
    }

    /// The correction of a keyframe, from that of the next.
    fn solve_one(&mut self, index: usize) {
        let next = self.window.get(index + 1).map(|next| next.correction);
        let correction = next.and_then(|next| self.back(index, &next));
        if let (Some(keyframe), Some(correction)) = (self.window.get_mut(index), correction) {
            keyframe.correction = correction;
        }
    }

    /// The same, given that of the next.
    pub(super) fn back(&self, index: usize, next: &[f64; N]) -> Option<[f64; N]> {
        let (keyframe, after) = (self.window.get(index)?, self.window.get(index + 1)?);
        let coupling = self.landmarks.as_ref().map(|landmarks| &landmarks.coupling);
        let Some(coupling) = coupling.filter(|coupling| coupling.is_tied()) else {
            return Some(keyframe.pivot.back(&after.link, next));
        };
        let later = self.window.range(index + 2..).map(|keyframe| &keyframe.correction);
        let pull = coupling.pull(index, core::iter::once(next).chain(later));
        Some(keyframe.pivot.back_pulled(&after.link, next, &pull))
    }

    /// Corrections of all keyframes.
    pub(super) fn solve_all(&mut self) {
        if let Some(newest) = self.window.back_mut() {
            newest.correction = newest.pivot.newest();
        }
        self.solve_back(self.window.len().saturating_sub(1), 0);
        self.exact_from = 0;
    }

    /// Whether landmarks tie keyframes to others than their neighbours.
    pub(super) fn is_tied(&self) -> bool {
        self.landmarks.as_ref().is_some_and(|landmarks| landmarks.coupling.is_tied())
    }

    /// Corrections of all keyframes that have changed by more than matters, at least of those from `least` on; the first of
    /// them.
    fn solve(&mut self, least: usize) -> usize {
        if self.is_tied() {
            self.solve_all();
            return 0;
        }
        let Some(newest) = self.window.back_mut() else { return 0 };
        newest.correction = newest.pivot.newest();
        let mut first = self.window.len() - 1;
        while first > 0 {
            let window = self.window.make_contiguous();
            let (these, after) = window.split_at_mut(first);
            let (Some(keyframe), Some(next)) = (these.last_mut(), after.first()) else { break };
            let correction = keyframe.pivot.back(&next.link, &next.correction);
            // What is below adds up, since it is not stored.
            if first <= least && is_settled(&correction, &keyframe.correction, &self.params) {
                break;
            }
            keyframe.correction = correction;
            first -= 1;
        }
        self.exact_from = first;
        first
    }

    /// Estimates the window from all that was added.
    ///
    /// Keyframes that moved far are linearised again, and what they concern is eliminated again, as often as the
    /// parameters allow. It is no error if that is not often enough: the next update goes on.
    ///
    /// # Errors
    ///
    /// [`Refusal::NotStarted`]; [`Refusal::NonFinite`] if the estimate is beyond all numbers: start afresh.
    pub fn update(&mut self) -> Result<Updated, Refusal> {
        if self.window.is_empty() {
            return Err(Refusal::NotStarted);
        }
        let mut updated = Updated::default();
        if let Some(landmarks) = &mut self.landmarks {
            landmarks.judged = None;
        }
        for iteration in 0..=self.params.iterations {
            let least = self.dirty;
            updated.eliminated += self.eliminate(self.window.len());
            let first = self.solve(least);
            if !self.window.range(first..).all(|keyframe| keyframe.correction.iter().all(|x| x.is_finite())) {
                return Err(Refusal::NonFinite);
            }
            if iteration == self.params.iterations {
                break;
            }
            let moved = self.relinearise(first);
            updated.relinearised += moved;
            if self.dirty >= self.window.len() {
                break;
            }
        }
        Ok(updated)
    }

    /// Linearises again what moved far or weighs otherwise, from a keyframe on; how many moved.
    fn relinearise(&mut self, first: usize) -> usize {
        let mut moved = 0;
        let count = self.window.len();
        // Where a keyframe moved, the next has to be linearised as well.
        let mut is_next = false;
        for index in first..count {
            let params = &self.params;
            let window = self.window.make_contiguous();
            let (before, after) = window.split_at_mut(index);
            let (before, Some(keyframe)) = (before.last(), after.first_mut()) else { continue };
            let is_off = keyframe.is_free() && keyframe.is_off(params);
            if is_off {
                keyframe.relinearise::<S>();
                moved += 1;
            }
            if is_off || is_next || keyframe.is_misweighed::<S>(before.map(|before| &**before)) {
                keyframe.linearise::<S>(before.map(|before| &**before), params);
                self.dirty = self.dirty.min(index);
            }
            is_next = is_off;
        }
        let landmarks = self.landmarks.as_mut();
        if landmarks.is_some_and(|landmarks| landmarks.relinearise::<F, S>(&self.window) > 0) {
            self.dirty = 0;
        }
        moved
    }

    /// Eliminates all of the window.
    #[cfg(test)]
    pub(super) fn eliminate_all(&mut self) {
        self.dirty = 0;
        self.eliminate(self.window.len());
        self.solve(0);
    }
}

/// Whether two corrections are alike: a centimetre of position, or a hundredth of what is linearised again of rotation.
fn is_settled<const N: usize>(a: &[f64; N], b: &[f64; N], params: &SmootherParams) -> bool {
    let is_rotation = |i: usize| (ROTATION..ROTATION + 3).contains(&i);
    let limit = |i: usize| SETTLED * if is_rotation(i) { params.relinearise_rotation } else { 1.0 };
    a.iter().zip(b).enumerate().all(|(i, (a, b))| (a - b).abs() < limit(i))
}
