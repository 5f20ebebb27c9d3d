//! What can be asked of an estimator, and left for it, while it runs on whatever thread.

use super::counters::Counters;
use super::{EstimatorDeclaration, EstimatorStatistics, HealthState};
use crate::component::Fault;
use std::any::Any;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU8, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// One-way requests that wait for an estimator; one more is refused.
const MAX_CASTS: usize = 1024;

/// The part of a running estimator that is outside its island's lock.
#[derive(Clone, Debug)]
pub(crate) struct SharedNode(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    number: usize,
    declaration: &'static EstimatorDeclaration,
    counters: Counters,
    health: AtomicU8,
    /// Why it does not run, if it does not.
    stopped: Mutex<Option<String>>,
    /// None once the robot has stopped.
    casts: Mutex<Option<VecDeque<Box<dyn Any + Send>>>>,
    /// A parameter that its options are bound to has changed.
    options_changed: AtomicBool,
    /// Its supervisor starts it anew, though it has not failed.
    restart: AtomicBool,
    /// How long its callbacks pretend to take on virtual time.
    pretended_latency_nanos: AtomicI64,
}

impl SharedNode {
    pub(crate) fn new(number: usize, declaration: &'static EstimatorDeclaration) -> Self {
        Self(Arc::new(Inner {
            number,
            declaration,
            counters: Counters::new(declaration),
            health: AtomicU8::new(0),
            stopped: Mutex::new(None),
            casts: Mutex::new(Some(VecDeque::new())),
            options_changed: AtomicBool::new(false),
            restart: AtomicBool::new(false),
            pretended_latency_nanos: AtomicI64::new(0),
        }))
    }

    #[inline]
    pub(super) fn counters(&self) -> &Counters {
        &self.0.counters
    }

    /// Its number among the robot's estimators.
    pub(crate) fn number(&self) -> usize {
        self.0.number
    }

    pub(crate) fn declaration(&self) -> &'static EstimatorDeclaration {
        self.0.declaration
    }

    /// Counts a message that did not fit in an inbox.
    pub(crate) fn overflow(&self, input: usize) {
        self.0.counters.overflow(input);
    }

    pub(crate) fn statistics(&self) -> EstimatorStatistics {
        self.0.counters.statistics(self.0.declaration, self.health(), lock(&self.0.stopped).clone())
    }

    pub(crate) fn health(&self) -> HealthState {
        HealthState::from_index(self.0.health.load(Ordering::Relaxed))
    }

    pub(super) fn set_health(&self, state: HealthState) {
        self.0.health.store(state as u8, Ordering::Relaxed);
    }

    pub(super) fn stopped(&self) -> Option<String> {
        lock(&self.0.stopped).clone()
    }

    pub(super) fn set_stopped(&self, reason: Option<String>) {
        *lock(&self.0.stopped) = reason;
    }

    /// Leaves a one-way request; or says why not.
    pub(crate) fn leave_cast(&self, cast: Box<dyn Any + Send>) -> Result<(), Fault> {
        let path = self.0.declaration.path;
        match lock(&self.0.casts).as_mut() {
            None => Err(Fault::new(format!("{path} does not run any more"))),
            Some(casts) if casts.len() >= MAX_CASTS => {
                Err(Fault::new(format!("too many requests wait for {path}")))
            }
            Some(casts) => {
                casts.push_back(cast);
                Ok(())
            }
        }
    }

    pub(super) fn take_cast(&self) -> Option<Box<dyn Any + Send>> {
        lock(&self.0.casts).as_mut()?.pop_front()
    }

    /// Takes no requests any more; those that wait are dropped.
    pub(super) fn refuse_casts(&self) {
        let casts = lock(&self.0.casts).take();
        drop(casts);
    }

    pub(crate) fn change_options(&self) {
        self.0.options_changed.store(true, Ordering::Release);
    }

    pub(super) fn take_changed_options(&self) -> bool {
        self.0.options_changed.load(Ordering::Relaxed) && self.0.options_changed.swap(false, Ordering::AcqRel)
    }

    pub(crate) fn restart(&self) {
        self.0.restart.store(true, Ordering::Release);
    }

    pub(super) fn take_restart(&self) -> bool {
        self.0.restart.load(Ordering::Relaxed) && self.0.restart.swap(false, Ordering::AcqRel)
    }

    pub(crate) fn pretend_latency(&self, nanos: i64) {
        self.0.pretended_latency_nanos.store(nanos, Ordering::Relaxed);
    }

    pub(super) fn pretended_latency_nanos(&self) -> i64 {
        self.0.pretended_latency_nanos.load(Ordering::Relaxed)
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
