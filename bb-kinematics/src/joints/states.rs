//! The histories of all joints, under one lock.

use super::error::{Gap, Missing};
use super::history::{History, State};
use super::status::{JointRefusal, REFUSALS};
use crate::topology::Topology;
use bb_message::__private::nanos_of;
use bb_message::time::MonotonicTime;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Time by which a stamp may be ahead of the clock.
const MAX_SKEW_NANOS: i64 = 1_000_000_000;

/// The most unknown joint names that are counted individually.
const MOST_UNKNOWN: usize = 64;

/// [`States`] that any thread may read and add to. The lock is held only while a few numbers are copied, and no user code runs
/// meanwhile.
#[derive(Debug)]
pub(super) struct SharedStates {
    states: Mutex<States>,
    arrived: Condvar,
    /// The number of threads waiting for a state.
    waiting: AtomicUsize,
}

#[derive(Debug)]
pub(super) struct States {
    /// One entry for each joint of the topology.
    known: Box<[Known]>,
    unknown: Vec<(String, u64)>,
}

/// The history and the counts of one joint.
#[derive(Debug)]
pub(super) struct Known {
    pub(super) history: History,
    pub(super) states: u64,
    pub(super) refused: [u64; REFUSALS],
}

impl SharedStates {
    pub(super) fn new(topology: &Topology, capacity: usize, history: Duration) -> Self {
        let known = topology.joints.iter().map(|joint| Known {
            history: History::new(joint.kind, capacity, nanos_of(history)),
            states: 0,
            refused: [0; REFUSALS],
        });
        let states = States { known: known.collect(), unknown: Vec::new() };
        Self { states: Mutex::new(states), arrived: Condvar::new(), waiting: AtomicUsize::new(0) }
    }

    #[inline]
    pub(super) fn lock(&self) -> MutexGuard<'_, States> {
        // Also after a panic of code that held it.
        self.states.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a state that arrived at `now`. Returns the reason if the state is the first to be refused for it.
    pub(super) fn add(&self, joint: usize, state: State<'_>, now: MonotonicTime) -> Option<JointRefusal> {
        let mut states = self.lock();
        let known = states.known.get_mut(joint)?;
        let added = if state.time > now.plus_nanos(MAX_SKEW_NANOS) {
            Err(JointRefusal::ClockSkew)
        } else {
            known.history.add(state)
        };
        match added {
            Ok(()) => {
                known.states += 1;
                drop(states);
                // A waiting thread counts itself while it holds the lock.
                if self.waiting.load(Ordering::Relaxed) > 0 {
                    self.arrived.notify_all();
                }
                None
            }
            Err(reason) => {
                let count = &mut known.refused[reason as usize];
                *count += 1;
                (*count == 1).then_some(reason)
            }
        }
    }

    /// Counts a state of an unknown joint; returns whether it is the first one.
    pub(super) fn add_unknown(&self, name: &str) -> bool {
        let mut states = self.lock();
        if let Some((_, count)) = states.unknown.iter_mut().find(|(known, _)| known == name) {
            *count += 1;
            return false;
        }
        let has_room = states.unknown.len() < MOST_UNKNOWN;
        if has_room {
            states.unknown.push((name.to_owned(), 1));
        }
        has_room
    }

    /// Calls `lookup` until it succeeds, no new state can change its answer, or `timeout` expires.
    pub(super) fn wait<T>(
        &self,
        timeout: Duration,
        mut lookup: impl FnMut(&States) -> Result<T, Gap>,
    ) -> Result<T, Gap> {
        let start = Instant::now();
        let mut states = self.lock();
        self.waiting.fetch_add(1, Ordering::Relaxed);
        let answer = loop {
            let answer = lookup(&states);
            let may_come = matches!(answer, Err(Gap::Unknown { .. } | Gap::InFuture { .. }));
            let left = timeout.saturating_sub(start.elapsed());
            if !may_come || left.is_zero() {
                break answer;
            }
            states = self.arrived.wait_timeout(states, left).unwrap_or_else(PoisonError::into_inner).0;
        };
        self.waiting.fetch_sub(1, Ordering::Relaxed);
        answer
    }
}

impl States {
    pub(super) fn known(&self) -> &[Known] {
        &self.known
    }

    /// Names of unknown joints, and how often they occurred.
    pub(super) fn unknown(&self) -> &[(String, u64)] {
        &self.unknown
    }

    pub(super) fn history(&self, joint: usize) -> Option<&History> {
        self.known.get(joint).map(|known| &known.history)
    }

    /// Writes the position of a joint at a time to `position`.
    #[inline]
    pub(super) fn sample(
        &self,
        joint: usize,
        time: MonotonicTime,
        tolerance_nanos: i64,
        position: &mut [f64],
    ) -> Result<(), Gap> {
        let known = self.known.get(joint).ok_or(Gap::Unknown { joint })?;
        known.history.sample(time, tolerance_nanos, position).map_err(|missing: Missing| missing.of(joint))
    }

    pub(super) fn newest(&self, joint: usize) -> Result<i64, Gap> {
        let newest = self.known.get(joint).and_then(|known| known.history.newest());
        newest.ok_or(Gap::Unknown { joint })
    }
}
