//! Factors on two keyframes that are not neighbours.
//!
//! The chain has no place for them. They couple the poses of their keyframes as a landmark does that both have seen, and are carried
//! along its elimination in the same way; see `coupling.rs`. When the earlier keyframe leaves, what they say stays in the prior.

use super::elimination::judge_with;
use super::filter::FixedLagSmoother;
use super::kernel::Kernel;
use super::keyframe::Held;
use super::landmarks::Landmarks;
use super::pair::{Pair, linearised};
use crate::navigation::factor::{Factor, Rows};
use crate::navigation::fused::{Fused, Judged};
use crate::navigation::refusal::Refusal;
use crate::navigation::state::States;
use crate::navigation::stream::{Gate, Stream};

impl<S: States, const N: usize, F: Factor<S, N>> FixedLagSmoother<S, N, F> {
    /// Gates and adds a factor on a keyframe and an earlier one that is not the one directly before.
    pub(super) fn fuse_pair(
        &mut self,
        stream: &Stream,
        (id, to): (u64, usize),
        factor: F,
        kernel: Kernel,
    ) -> Result<Fused, Refusal> {
        let missing = Refusal::NoKeyframe { id };
        let from = self.window.iter().take(to).position(|keyframe| keyframe.id == id).ok_or(missing)?;
        let (earlier, later) = self.window.get(from).zip(self.window.get(to)).ok_or(missing)?;
        let full = Refusal::Full { id: later.id };
        let mut rows = Rows::new();
        linearised::<F, S, N>(&factor, earlier, later, &mut rows)?;
        let trust = 1.0 / stream.params().variance_factor;
        rows.weigh(trust);
        let judged = self.judged_pair((from, to), &rows).ok_or(Refusal::NonFinite)?;
        let fused = stream.weigh(&judged, rows.count, Gate::Closed)?;
        let held = Held { factor, kernel, trust: trust * fused.weight, weight: 1.0 };
        let window = self.params.window;
        let coupling = &mut self.landmarks.get_or_insert_with(|| Landmarks::none(window)).coupling;
        let serials = (coupling.first + from as u64, coupling.first + to as u64);
        if self.pairs.iter().filter(|pair| pair.to == serials.1).count() >= self.params.factors {
            return Err(full);
        }
        let mut pair = Pair::new(held, serials);
        let (earlier, later) = self.window.get(from).zip(self.window.get(to)).ok_or(missing)?;
        pair.linearise::<S>(earlier, later);
        coupling.add_pair((from, to), pair.rows(), 1.0);
        self.pairs.push(pair);
        self.dirty = self.dirty.min(from);
        Ok(fused)
    }

    /// Compares such a factor with the estimates of its keyframes.
    fn judged_pair(&mut self, (from, to): (usize, usize), rows: &Rows<N>) -> Option<Judged> {
        self.eliminate(self.window.len());
        let newest = self.window.back_mut()?;
        newest.correction = newest.pivot.newest();
        let (earlier, later) = (self.correction_at(from)?, self.correction_at(to)?);
        let covariance = self.pair_covariance((from, to), rows)?;
        judge_with(rows, (&earlier, &later), covariance)
    }

    /// Linearises those factors again whose keyframes were, or whose weights changed.
    pub(super) fn relinearise_pairs(&mut self) {
        let Some(landmarks) = self.landmarks.as_mut().filter(|_| !self.pairs.is_empty()) else { return };
        let coupling = &mut landmarks.coupling;
        for pair in &mut self.pairs {
            let (from, to) = ((pair.from - coupling.first) as usize, (pair.to - coupling.first) as usize);
            let Some((earlier, later)) = self.window.get(from).zip(self.window.get(to)) else { continue };
            if pair.is_stale(earlier, later) {
                coupling.add_pair((from, to), pair.rows(), -1.0);
                pair.linearise::<S>(earlier, later);
                coupling.add_pair((from, to), pair.rows(), 1.0);
            }
        }
        self.dirty = self.dirty.min(coupling.changed());
    }

    /// Called before the oldest keyframe is marginalised: what its factors say of later ones becomes part of the prior, as linearised.
    pub(super) fn release_pairs(&mut self) {
        let Some(landmarks) = self.landmarks.as_ref().filter(|_| !self.pairs.is_empty()) else { return };
        let first = landmarks.coupling.first;
        let window = &mut self.window;
        self.pairs.retain(|pair| {
            if pair.from == first
                && let Some(later) = window.get_mut((pair.to - first) as usize)
            {
                later.is_fixed = true;
            }
            pair.from != first
        });
    }
}
