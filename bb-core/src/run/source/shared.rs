//! The state of a source that other threads share: orders, counts and failures.

use crate::component::Counts;
use crate::control::ComponentOrder;
use crate::fault::lock;
use crate::run::occupied::{Entered, Occupied};
use crate::time::{Clock, MonotonicTime};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::Thread;

/// A handle to the shared state of a source.
#[derive(Clone, Debug)]
pub(crate) struct SharedSource(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    path: &'static str,
    /// `true` if the component is read at a rate; otherwise it may wait for its device.
    has_rate: bool,
    inbox: Mutex<Inbox>,
    readings: AtomicU64,
    skipped: AtomicU64,
    restarts: AtomicU64,
    occupied: Occupied,
    stopped: Mutex<Option<String>>,
    failing: Mutex<Option<Failing>>,
    counters: Counts,
}

/// Failures without a reading between them.
#[derive(Clone, Copy, Debug)]
struct Failing {
    since: MonotonicTime,
    /// Number of readings at the last failure.
    readings: u64,
}

#[derive(Debug, Default)]
struct Inbox {
    /// Orders, each kind at most once.
    orders: Vec<Order>,
    thread: Option<Thread>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::run) enum Order {
    Options,
    Supervisor(ComponentOrder),
}

/// Counts of a sensor or a service since the start.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct SourceStatistics {
    /// Path of the component.
    pub path: &'static str,
    /// Number of readings.
    pub readings: u64,
    /// Number of readings missed because the component, or one downstream, took longer than its period.
    pub skipped: u64,
    /// Number of restarts.
    pub restarts: u64,
    /// Reason for which the component does not run, if it does not.
    pub stopped: Option<String>,
    /// Time since which the component has failed without a reading in between, even if it has been restarted meanwhile.
    pub failing_since: Option<MonotonicTime>,
    /// Counts by name, see [`ServiceContext::counter`](crate::ServiceContext::counter).
    pub counts: Vec<(&'static str, u64)>,
}

impl SourceStatistics {
    /// The component's count of this name; 0 if it has none.
    pub fn count(&self, name: &str) -> u64 {
        self.counts.iter().find(|(known, _)| *known == name).map_or(0, |(_, count)| *count)
    }
}

impl SharedSource {
    pub(super) fn new(path: &'static str, has_rate: bool, counters: Counts) -> Self {
        Self(Arc::new(Shared {
            path,
            has_rate,
            inbox: Mutex::default(),
            readings: AtomicU64::new(0),
            skipped: AtomicU64::new(0),
            restarts: AtomicU64::new(0),
            occupied: Occupied::new(),
            stopped: Mutex::default(),
            failing: Mutex::default(),
            counters,
        }))
    }

    pub(super) fn tell(&self, order: Order) {
        let mut inbox = lock(&self.0.inbox);
        if !inbox.orders.contains(&order) {
            inbox.orders.push(order);
        }
        if let Some(thread) = &inbox.thread {
            thread.unpark();
        }
    }

    pub(super) fn take_orders(&self) -> Vec<Order> {
        std::mem::take(&mut lock(&self.0.inbox).orders)
    }

    /// Makes the calling thread the one that reads the source, so that orders wake it.
    pub(in crate::run) fn adopt(&self) {
        lock(&self.0.inbox).thread = Some(std::thread::current());
    }

    pub(in crate::run) fn path(&self) -> &'static str {
        self.0.path
    }

    pub(in crate::run) fn has_rate(&self) -> bool {
        self.0.has_rate
    }

    /// Returns the time at which the component's code was entered, if a thread is inside.
    pub(in crate::run) fn entered_at(&self) -> Option<MonotonicTime> {
        self.0.occupied.entered_at()
    }

    pub(super) fn enter(&self, clock: &Clock) -> Entered<'_> {
        self.0.occupied.enter(clock)
    }

    pub(in crate::run) fn statistics(&self) -> SourceStatistics {
        let readings = self.0.readings.load(Ordering::Relaxed);
        // After a restart, the next reading shows that the component has recovered.
        let failing = lock(&self.0.failing).filter(|failing| readings == failing.readings);
        SourceStatistics {
            path: self.0.path,
            readings,
            skipped: self.0.skipped.load(Ordering::Relaxed),
            restarts: self.0.restarts.load(Ordering::Relaxed),
            stopped: lock(&self.0.stopped).clone(),
            failing_since: failing.map(|failing| failing.since),
            counts: self.0.counters.all(),
        }
    }

    pub(super) fn count_reading(&self) {
        self.0.readings.fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn count_skipped(&self, skipped: u64) {
        self.0.skipped.fetch_add(skipped, Ordering::Relaxed);
    }

    pub(super) fn note_restart(&self) {
        self.0.restarts.fetch_add(1, Ordering::Relaxed);
        *lock(&self.0.stopped) = None;
    }

    pub(super) fn note_stop(&self, reason: String) {
        *lock(&self.0.stopped) = Some(reason);
    }

    /// Records the time since which the component has been failing.
    pub(super) fn note_failure(&self, now: MonotonicTime) {
        let readings = self.0.readings.load(Ordering::Relaxed);
        let mut failing = lock(&self.0.failing);
        // The attempt that has failed is counted too.
        let since = failing.filter(|before| readings <= before.readings + 1).map_or(now, |before| before.since);
        *failing = Some(Failing { since, readings });
    }
}
