//! Comparison of a replay with its journal.

use super::lock;
use bb_message::__private::Sorted;
use std::collections::VecDeque;
use std::sync::Mutex;

/// State used by a replay and its comparison with the journal.
#[derive(Debug, Default)]
pub(crate) struct Comparison {
    /// Outputs of islands: publisher and checksum, in order.
    outputs: Mutex<Sorted<usize, VecDeque<(usize, u64)>>>,
    missing: Mutex<Option<Missing>>,
}

/// A value that an estimator asked for in a replay but the journal does not have.
#[derive(Clone, Debug)]
pub(crate) struct Missing {
    /// Path of the estimator.
    pub(crate) estimator: &'static str,
    /// The missing value, such as `how long its callback took`.
    pub(crate) what: String,
}

impl Comparison {
    pub(crate) fn add(&self, island: usize, publisher: usize, checksum: u64) {
        lock(&self.outputs).get_or_insert(island, VecDeque::new).push_back((publisher, checksum));
    }

    /// Takes the first output of an island that has not been compared yet.
    pub(crate) fn take(&self, island: usize) -> Option<(usize, u64)> {
        lock(&self.outputs).get_mut(&island)?.pop_front()
    }

    /// Keeps the first value missing in a turn.
    pub(in crate::node) fn miss(&self, missing: Missing) {
        lock(&self.missing).get_or_insert(missing);
    }

    pub(crate) fn take_missing(&self) -> Option<Missing> {
        lock(&self.missing).take()
    }
}
