//! One running estimator.

use super::admission::Admission;
use super::counters::Counters;
use super::{DropReason, EstimatorDeclaration, EstimatorStatistics, InputDeclaration};
use crate::component::{Context, Estimator, Fault, InputAt, Inputs, Reply, SyncMiss};
use crate::message::{Stamp, Stamped};
use crate::run::{Failed, Startup, caught, retire};
use crate::time::Clock;
use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::{Duration, Instant};

/// One estimator with its fan-in and its counters. A message is handled on the thread that publishes it; a second
/// thread waits its turn, so that there is one writer at a time and the order of each input is kept.
pub struct Node<E: Estimator> {
    declaration: &'static EstimatorDeclaration,
    template: Stamp,
    clock: Clock,
    counters: Counters,
    /// Why it has stopped. Apart from the state, so that it can be asked while the estimator is busy.
    stopped: Mutex<Option<String>>,
    /// No message is handled any more.
    closing: AtomicBool,
    state: Mutex<State<E>>,
}

struct State<E: Estimator> {
    /// None once it has stopped.
    estimator: Option<E>,
    cache: <E::Input as Inputs>::Cache,
    admission: Admission,
}

/// What became of a message.
enum Handled<O> {
    Refused(DropReason),
    Stored,
    Missed(SyncMiss),
    Ran(Reply<O>),
}

impl<E: Estimator> Node<E> {
    /// Makes the estimator; what keeps it from starting is in `startup`.
    pub fn new(declaration: &'static EstimatorDeclaration, options: &E::Options, startup: &Startup) -> Self {
        let context = Context { robot: startup.robot(), declaration };
        let estimator = startup.make(declaration.path, options, |options| E::init(options, &context));
        Self {
            declaration,
            template: Stamp { frame: declaration.frame, origin: startup.origin(), ..Stamp::default() },
            clock: startup.clock().clone(),
            counters: Counters::new(declaration),
            stopped: Mutex::new(None),
            closing: AtomicBool::new(false),
            state: Mutex::new(State {
                estimator,
                cache: Default::default(),
                admission: Admission::new(declaration.inputs.len()),
            }),
        }
    }

    /// Says which declared input fills field `I`.
    pub fn declare<const I: usize>(self, input: usize) -> Self
    where
        E::Input: InputAt<I>,
    {
        if let Some(declared) = self.declaration.inputs.get(input)
            && let Some(slot) = E::Input::slot(&mut self.lock().cache)
        {
            slot.declare(declared);
        }
        self
    }

    /// Takes a message of the declared input number `input`, which is the algorithm's field `I`. If it is the driver
    /// and all is well, the estimator runs and `emit` gets what it emitted.
    #[inline]
    pub fn receive<const I: usize>(
        &self,
        input: usize,
        message: &Stamped<<E::Input as InputAt<I>>::Payload>,
        emit: impl FnOnce(&mut Option<E::Output>, Stamp),
    ) where
        E::Input: InputAt<I>,
    {
        let Some(declared) = self.declaration.inputs.get(input) else {
            return;
        };
        let mut state = self.lock();
        let State { estimator, cache, admission } = &mut *state;
        self.counters.inputs[input].received.increment();
        let Some(running) = estimator.as_mut().filter(|_| !self.closing.load(Ordering::Relaxed)) else {
            return self.counters.drop(input, DropReason::Stopped);
        };
        // All of the user's code at once: the payload's, the cache's clone and the estimator. After a panic the
        // estimator is dropped, so that nothing sees what was left half done.
        let handled = caught(|| {
            if let Err(reason) = admission.admit(input, message, &self.clock) {
                return Ok(Handled::Refused(reason));
            }
            if !declared.driver {
                if let Some(slot) = <E::Input as InputAt<I>>::slot(cache) {
                    slot.store(message);
                }
                return Ok(Handled::Stored);
            }
            let view = match <E::Input as InputAt<I>>::snapshot(cache, message) {
                Ok(view) => view,
                Err(miss) => return Ok(Handled::Missed(miss)),
            };
            self.counters.dispatched.increment();
            running.handle_input(view).map(Handled::Ran)
        });
        match handled {
            Ok(Handled::Ran(reply)) => {
                let stamp =
                    Stamp { monotonic_time: message.monotonic_time, wall_time: message.wall_time, ..self.template };
                self.complete(reply, stamp, emit);
            }
            Ok(Handled::Stored) => {}
            Ok(Handled::Refused(reason)) => self.refuse(declared, reason, message.monotonic_time.as_nanos()),
            Ok(Handled::Missed(miss)) => self.miss(miss),
            Err(failed) => self.fail(&mut state, failed),
        }
    }

    #[inline]
    fn complete(&self, reply: Reply<E::Output>, stamp: Stamp, emit: impl FnOnce(&mut Option<E::Output>, Stamp)) {
        let Reply { mut output, diverged } = reply;
        if let Some(reason) = diverged {
            self.counters.diverge(reason);
            tracing::debug!(estimator = self.declaration.path, reason, "diverged");
        }
        if output.is_some() {
            self.counters.emitted.increment();
            emit(&mut output, stamp);
        }
    }

    #[cold]
    fn refuse(&self, input: &InputDeclaration, reason: DropReason, time_nanos: i64) {
        self.counters.drop(input.index, reason);
        let (estimator, input, reason) = (self.declaration.path, input.name, reason.name());
        tracing::debug!(estimator, input, reason, time_nanos, "message dropped");
    }

    #[cold]
    fn miss(&self, miss: SyncMiss) {
        self.counters.drop(miss.input, DropReason::SyncMiss);
        let Some(input) = self.declaration.inputs.get(miss.input) else {
            return;
        };
        let (age_nanos, tolerance_nanos) = (miss.age_nanos, input.tolerance_nanos);
        let (estimator, input) = (self.declaration.path, input.name);
        tracing::debug!(estimator, input, age_nanos, tolerance_nanos, "dispatch dropped for sync");
    }

    #[cold]
    fn fail(&self, state: &mut State<E>, Failed { fault, panicked }: Failed) {
        self.stopped_by(&fault);
        if let Some(estimator) = state.estimator.take() {
            // What goes wrong from here on follows from the fault that is known.
            let _ = retire(estimator, panicked, E::terminate);
        }
    }

    fn stopped_by(&self, fault: &Fault) {
        tracing::error!(estimator = self.declaration.path, %fault, "estimator stopped");
        *self.stopped.lock().unwrap_or_else(PoisonError::into_inner) = Some(fault.to_string());
    }

    fn lock(&self) -> MutexGuard<'_, State<E>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The state, once the estimator is no longer busy; none after `deadline`.
    fn lock_until(&self, deadline: Instant) -> Option<MutexGuard<'_, State<E>>> {
        loop {
            match self.state.try_lock() {
                Ok(state) => return Some(state),
                Err(TryLockError::Poisoned(poisoned)) => return Some(poisoned.into_inner()),
                Err(TryLockError::WouldBlock) if Instant::now() >= deadline => return None,
                Err(TryLockError::WouldBlock) => std::thread::sleep(Duration::from_millis(1)),
            }
        }
    }
}

impl<E: Estimator> Drop for Node<E> {
    /// Of a robot that did not start.
    fn drop(&mut self) {
        let state = self.state.get_mut().unwrap_or_else(PoisonError::into_inner);
        if let Some(estimator) = state.estimator.take() {
            let _ = retire(estimator, false, E::terminate);
        }
    }
}

impl<E: Estimator> fmt::Debug for Node<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Node").field("path", &self.declaration.path).finish_non_exhaustive()
    }
}

/// What all running estimators have in common.
pub trait AnyNode {
    /// Its path.
    fn path(&self) -> &'static str;
    /// What it has counted; also while it is busy.
    fn statistics(&self) -> EstimatorStatistics;
    /// Lets the estimator clean up and drops it; messages that still come are counted as dropped. False if it is still
    /// busy at `deadline`; it is then left as it is.
    fn terminate(&self, deadline: Instant) -> bool;
}

impl<E: Estimator> AnyNode for Node<E> {
    fn path(&self) -> &'static str {
        self.declaration.path
    }

    fn statistics(&self) -> EstimatorStatistics {
        let stopped = self.stopped.lock().unwrap_or_else(PoisonError::into_inner).clone();
        self.counters.statistics(self.declaration, stopped)
    }

    fn terminate(&self, deadline: Instant) -> bool {
        self.closing.store(true, Ordering::Relaxed);
        let Some(mut state) = self.lock_until(deadline) else { return false };
        let estimator = state.estimator.take();
        drop(state);
        if let Some(fault) = estimator.and_then(|estimator| retire(estimator, false, E::terminate)) {
            self.stopped_by(&fault);
        }
        true
    }
}
