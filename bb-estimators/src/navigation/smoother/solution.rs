//! Solving the window: eliminates what has changed and relinearises what has moved.

use super::filter::FixedLagSmoother;
use super::params::SmootherParams;
use crate::navigation::factor::Factor;
use crate::navigation::numbers::SETTLED;
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{ROTATION, States};

/// The work done by an update.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Updated {
    /// Number of keyframe eliminations, counting repeated ones.
    pub eliminated: usize,
    /// Number of keyframe relinearisations, counting repeated ones.
    pub relinearised: usize,
    /// `true` if it has reached the solution. If not, the limit of iterations was reached while a keyframe was still moving by more than
    /// [`relinearise_rotation`](SmootherParams::relinearise_rotation) or [`relinearise_position`](SmootherParams::relinearise_position)
    /// from one iteration to the next: the covariance is that of another place.
    pub is_converged: bool,
}

impl<S: States, const N: usize, F: Factor<S, N>> FixedLagSmoother<S, N, F> {
    /// Linearises all factors on a keyframe, including those that it shares with the previous one.
    pub(super) fn linearise(&mut self, index: usize) {
        let coupling = self.landmarks.as_mut().map(|landmarks| &mut landmarks.coupling);
        let (before, after) = self.window.make_contiguous().split_at_mut(index);
        let Some(keyframe) = after.first_mut() else { return };
        let coupling = coupling.filter(|coupling| coupling.is_tied()).map(|coupling| (coupling, keyframe.link));
        keyframe.linearise::<S>(before.last().map(|before| &**before), &self.params);
        // A new weight or linearisation point of a factor on this keyframe alone leaves the link as it was.
        if let Some((coupling, link)) = coupling
            && link != keyframe.link
        {
            coupling.relink(index);
        }
    }

    /// Eliminates the keyframes from the first that changed up to `end`, exclusive. Returns how many were eliminated.
    pub(super) fn eliminate(&mut self, end: usize) -> usize {
        let len = self.window.len();
        let end = end.min(len);
        let mut landmarks = self.landmarks.as_mut().filter(|landmarks| landmarks.coupling.is_tied());
        // A keyframe passes its ties to all later ones.
        let end = if landmarks.is_some() { len } else { end };
        let mut first = self.dirty;
        // If only the newest changed, neither by a landmark nor in its link, nothing that others leave did.
        let is_passing = landmarks.as_ref().is_some_and(|of| of.coupling.is_changed() || first + 1 < len);
        if let Some(landmarks) = landmarks.as_mut().filter(|_| is_passing) {
            landmarks.gather(len);
            landmarks.coupling.begin(len);
            first = 0;
        }
        let mut coupling = landmarks.map(|landmarks| &mut landmarks.coupling);
        let window = self.window.make_contiguous();
        for index in first..end {
            let (before, after) = window.split_at_mut(index);
            let Some(keyframe) = after.first_mut() else { break };
            if let Some(before) = before.last_mut() {
                keyframe.incoming = before.pivot.eliminate(&keyframe.link);
                if let Some(coupling) = &mut coupling {
                    let carried = before.pivot.carried(&keyframe.link);
                    coupling.fold(index - 1, &carried, &mut keyframe.incoming.matrix);
                    if is_passing && index > first {
                        coupling.pass(index - 1, len, &carried);
                    }
                }
            }
            if let Some(coupling) = coupling.as_mut().filter(|_| is_passing) {
                keyframe.seen = coupling.arrive(index, len);
            }
            keyframe.pivot.take(&keyframe.known());
        }
        if let Some(coupling) = coupling {
            coupling.finish();
        }
        self.dirty = self.dirty.max(end);
        if !is_passing {
            self.exact_from = self.exact_from.max(first.min(self.window.len()));
        }
        end.saturating_sub(first)
    }

    /// Solves for the corrections from the keyframe before `from`, which has its own, back to `to`.
    pub(super) fn solve_back(&mut self, from: usize, to: usize) {
        for index in (to..from).rev() {
            self.solve_one(index);
        }
    }

    /// Solves for the correction of a keyframe, given that of the next.
    fn solve_one(&mut self, index: usize) {
        let next = self.window.get(index + 1).map(|next| next.correction);
        let correction = next.and_then(|next| self.back(index, &next));
        if let (Some(keyframe), Some(correction)) = (self.window.get_mut(index), correction) {
            keyframe.correction = correction;
        }
    }

    /// Solves for the correction of a keyframe, given that of the next keyframe.
    pub(super) fn back(&self, index: usize, next: &[f64; N]) -> Option<[f64; N]> {
        let (keyframe, after) = (self.window.get(index)?, self.window.get(index + 1)?);
        let Some(coupling) = self.coupling() else {
            return Some(keyframe.pivot.back(&after.link, next));
        };
        let later = self.window.range(index + 2..).map(|keyframe| &keyframe.correction);
        let pull = coupling.pull(index, core::iter::once(next).chain(later));
        Some(keyframe.pivot.back_pulled(&after.link, next, &pull))
    }

    /// Solves for the corrections of all keyframes.
    pub(super) fn solve_all(&mut self) {
        if let Some(newest) = self.window.back_mut() {
            newest.correction = newest.pivot.newest();
        }
        self.solve_back(self.window.len().saturating_sub(1), 0);
        if let Some(landmarks) = &mut self.landmarks {
            if landmarks.coupling.needs_points() {
                landmarks.gather(self.window.len());
                landmarks.coupling.factor_points();
            }
            landmarks.coupling.solve_points(self.window.iter().map(|keyframe| &keyframe.correction));
        }
        self.exact_from = 0;
    }

    /// Returns whether landmarks, or factors on two of them, couple keyframes that are not neighbours.
    pub(super) fn is_tied(&self) -> bool {
        self.coupling().is_some()
    }

    /// Solves for the corrections that changed noticeably, and at least for those from `least` on. Returns the index of
    /// the first keyframe that is up to date.
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
            // A smaller change is not stored, so that small changes accumulate.
            if first <= least && is_settled(&correction, &keyframe.correction, &self.params) {
                break;
            }
            keyframe.correction = correction;
            first -= 1;
        }
        self.exact_from = first;
        first
    }

    /// Solves the window with everything added since the last update.
    ///
    /// Keyframes that moved far are relinearised and eliminated again, as often as the parameters allow. Reaching that
    /// limit is not an error: the next update continues, and [`Updated::is_converged`] is `false`.
    ///
    /// # Errors
    ///
    /// [`Refusal::NotStarted`]; [`Refusal::NonFinite`] if the estimate is no longer finite: restart the smoother.
    pub fn update(&mut self) -> Result<Updated, Refusal> {
        if self.window.is_empty() {
            return Err(Refusal::NotStarted);
        }
        let mut updated = Updated::default();
        if let Some(landmarks) = &mut self.landmarks {
            landmarks.judging.forget();
        }
        self.window.iter_mut().for_each(|keyframe| keyframe.has_moved = false);
        let continues = core::mem::take(&mut self.is_pending);
        if continues {
            // The keyframes that are still moving need not be among those that change now.
            updated.relinearised += self.relinearise(0);
        }
        for iteration in usize::from(continues)..=self.params.iterations {
            let least = self.dirty;
            updated.eliminated += self.eliminate(self.window.len());
            let first = self.solve(least);
            if !self.window.range(first..).all(|keyframe| keyframe.correction.iter().all(|x| x.is_finite())) {
                return Err(Refusal::NonFinite);
            }
            if iteration == self.params.iterations {
                // A keyframe that crosses its threshold for the first time only now has hardly moved. If none may be linearised again,
                // it may have crossed it long ago.
                let is_fixed = self.params.iterations == 0;
                let from = if is_fixed { 0 } else { first };
                let mut solved = self.window.range(from..).filter(|keyframe| keyframe.is_off(&self.params));
                updated.is_converged =
                    !solved.any(|keyframe| keyframe.has_moved || (is_fixed && keyframe.is_free()));
                self.is_pending = !updated.is_converged && !is_fixed;
                break;
            }
            let moved = self.relinearise(first);
            updated.relinearised += moved;
            if self.dirty >= self.window.len() {
                updated.is_converged = true;
                break;
            }
        }
        Ok(updated)
    }

    /// Relinearises, from `first` on, the keyframes that moved far or whose weights changed. Returns how many moved.
    fn relinearise(&mut self, first: usize) -> usize {
        let mut moved = 0;
        let count = self.window.len();
        // If a keyframe moved, the next must be linearised as well.
        let mut is_next = false;
        for index in first..count {
            let window = self.window.make_contiguous();
            let (before, after) = window.split_at_mut(index);
            let (before, Some(keyframe)) = (before.last(), after.first_mut()) else { continue };
            let is_off = keyframe.is_free() && keyframe.is_off(&self.params);
            keyframe.has_moved = false;
            if is_off {
                keyframe.relinearise::<S>();
                moved += 1;
            }
            if is_off || is_next || keyframe.is_misweighed::<S>(before.map(|before| &**before)) {
                self.linearise(index);
                self.dirty = self.dirty.min(index);
            }
            is_next = is_off;
        }
        self.relinearise_pairs();
        if let Some(landmarks) = &mut self.landmarks {
            landmarks.relinearise::<F, S>(&self.window);
            self.dirty = self.dirty.min(landmarks.coupling.changed());
        }
        moved
    }

    /// Eliminates the whole window.
    #[cfg(test)]
    pub(super) fn eliminate_all(&mut self) {
        self.dirty = 0;
        self.eliminate(self.window.len());
        self.solve(0);
    }
}

/// Returns whether two corrections agree to within a centimetre of position and a hundredth of the rotation threshold for relinearisation.
fn is_settled<const N: usize>(a: &[f64; N], b: &[f64; N], params: &SmootherParams) -> bool {
    let is_rotation = |i: usize| (ROTATION..ROTATION + 3).contains(&i);
    let limit = |i: usize| SETTLED * if is_rotation(i) { params.relinearise_rotation } else { 1.0 };
    a.iter().zip(b).enumerate().all(|(i, (a, b))| (a - b).abs() < limit(i))
}
