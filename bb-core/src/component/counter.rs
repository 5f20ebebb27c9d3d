//! Counters of a sensor or a service.

use crate::fault::lock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

/// A count of a sensor or a service, which the report and the metrics list: see
/// [`ServiceContext::counter`](super::ServiceContext::counter). Clones are the same.
#[derive(Clone, Debug, Default)]
pub struct Counter(Arc<AtomicU64>);

impl Counter {
    /// Adds one.
    pub fn add(&self) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }

    /// Adds a number of events at once.
    pub fn add_many(&self, number: u64) {
        self.0.fetch_add(number, Ordering::Relaxed);
    }

    /// The count since the start of the robot.
    pub fn get(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}

/// All counters of a component, by name. Clones are the same.
#[derive(Clone, Debug, Default)]
pub(crate) struct Counts(Arc<Mutex<Vec<(&'static str, Counter)>>>);

impl Counts {
    /// The counter of that name, made by the first who asks: a restarted component goes on counting.
    pub(super) fn get(&self, name: &'static str) -> Counter {
        let mut counters = lock(&self.0);
        if let Some((_, counter)) = counters.iter().find(|(known, _)| *known == name) {
            return counter.clone();
        }
        let counter = Counter::default();
        counters.push((name, counter.clone()));
        counter
    }

    pub(crate) fn all(&self) -> Vec<(&'static str, u64)> {
        let counters = lock(&self.0);
        counters.iter().map(|(name, counter)| (*name, counter.get())).collect()
    }
}
