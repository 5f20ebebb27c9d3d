//! Checks that the journal holds the whole turn of a line.

use super::Replayer;
use crate::journal::{Callback, Entry, Event, Request};

impl Replayer {
    /// Returns whether a line still lacks the durations of its callbacks, the places of its inputs, or the outputs emitted in reply to
    /// a request.
    pub(super) fn is_open(&self, entry: &Entry) -> bool {
        let Some(number) = self.island_of(&entry.event) else { return false };
        if let Event::Request { request: Request { bytes: None, .. }, .. } = &entry.event
            && self.next_of(number, 1).is_none()
        {
            return true;
        }
        self.has_not_ended(number, entry.number)
    }

    /// Returns whether the lines are missing that an island writes when that line's turn has ended.
    pub(super) fn has_not_ended(&self, island: usize, line: u64) -> bool {
        let island = self.machine.island(island);
        let is_measured = island.is_some_and(|island| island.declaration().is_measured);
        let routes = self.machine.environment.joints().routes();
        let is_placed = island.is_some_and(|island| routes.has_any(island.declaration().estimators));
        (is_measured && !self.measured.contains_key(&line)) || (is_placed && !self.placed.contains_key(&line))
    }

    /// Prepares the journal's data for the turn of a line; returns false if the journal ends before that turn does.
    pub(super) fn prepare(&mut self, island: usize, line: u64) -> bool {
        let is_whole = !self.has_not_ended(island, line);
        let environment = &self.machine.environment;
        for estimator in self.machine.island(island).map_or(&[][..], |island| island.declaration().estimators) {
            environment.node(*estimator).begin_replayed_turn();
        }
        for Callback { estimator, nanos } in self.measured.remove(&line).unwrap_or_default() {
            environment.node(estimator).replay_latency(nanos);
        }
        for placed in self.placed.remove(&line).unwrap_or_default() {
            environment.node(placed.estimator).replay_placement(placed);
        }
        is_whole
    }

    /// The next waiting line, from `first` on, that an island processed, or wrote while processing.
    pub(super) fn next_of(&self, island: usize, first: usize) -> Option<usize> {
        let is_of_island = |event: &Event| match event {
            Event::Output { island: other, .. } => *other == island,
            Event::Emission { publisher, .. } => self.emitter(*publisher).is_some_and(|(_, other)| other == island),
            other => self.island_of(other) == Some(island),
        };
        (first..self.waiting.len()).find(|&index| is_of_island(&self.waiting[index].event))
    }
}
