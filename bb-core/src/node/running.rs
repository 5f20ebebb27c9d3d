//! One running estimator.

use super::admission::Admission;
use super::counters::Counters;
use super::{DropReason, EstimatorDeclaration, EstimatorStatistics, InputDeclaration};
use crate::component::{Context, Estimator, Fault, InputAt, Inputs, Options, Reply, SyncMiss};
use crate::message::{Stamp, Stamped};
use crate::run::{StartError, Startup, caught};
use std::fmt;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// One estimator with its fan-in and its counters. A message is handled on the thread that publishes it; a second
/// thread waits its turn, so that there is one writer at a time and the order of each input is kept.
pub struct Node<E: Estimator> {
    declaration: &'static EstimatorDeclaration,
    template: Stamp,
    counters: Counters,
    state: Mutex<State<E>>,
}

struct State<E: Estimator> {
    /// None once it has stopped.
    estimator: Option<E>,
    stopped: Option<String>,
    cache: <E::Input as Inputs>::Cache,
    admission: Admission,
}

impl<E: Estimator> Node<E> {
    /// Validates the options and makes the estimator.
    ///
    /// # Errors
    /// Names the estimator and what keeps it from starting.
    pub fn new(
        declaration: &'static EstimatorDeclaration,
        options: E::Options,
        startup: &Startup,
    ) -> Result<Self, StartError> {
        let refused = |fault: Fault| StartError::component(declaration.path, fault);
        options.validate().map_err(|message| refused(Fault::new(message)))?;
        let context = Context { robot: startup.robot(), declaration };
        let estimator = caught(|| E::init(options, &context)).map_err(refused)?;
        Ok(Self {
            declaration,
            template: Stamp { frame: declaration.frame, origin: startup.origin(), ..Stamp::default() },
            counters: Counters::new(declaration),
            state: Mutex::new(State {
                estimator: Some(estimator),
                stopped: None,
                cache: Default::default(),
                admission: Admission::new(declaration.inputs.len()),
            }),
        })
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
        let State { estimator, cache, admission, .. } = &mut *state;
        self.counters.inputs[input].received.increment();
        let Some(running) = estimator else {
            return self.counters.drop(input, DropReason::Stopped);
        };
        if let Err(reason) = admission.admit(input, message) {
            return self.refuse(declared, reason, message.monotonic_time.as_nanos());
        }
        if !declared.driver {
            if let Some(slot) = <E::Input as InputAt<I>>::slot(cache) {
                slot.store(message);
            }
            return;
        }
        let view = match <E::Input as InputAt<I>>::snapshot(cache, message) {
            Ok(view) => view,
            Err(miss) => return self.miss(miss),
        };
        self.counters.dispatched.increment();
        // The estimator is dropped after a panic, so nothing sees what the panic left half done.
        match caught(|| running.handle_input(view)) {
            Ok(reply) => {
                let stamp =
                    Stamp { monotonic_time: message.monotonic_time, wall_time: message.wall_time, ..self.template };
                self.complete(reply, stamp, emit);
            }
            Err(fault) => self.stop(&mut state, &fault),
        }
    }

    #[inline]
    fn complete(&self, reply: Reply<E::Output>, stamp: Stamp, emit: impl FnOnce(&mut Option<E::Output>, Stamp)) {
        let Reply { mut output, diverged } = reply;
        if let Some(reason) = diverged {
            self.counters.diverged.increment();
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
    fn stop(&self, state: &mut State<E>, fault: &Fault) {
        tracing::error!(estimator = self.declaration.path, %fault, "estimator stopped");
        state.stopped = Some(fault.to_string());
        // Its own drop may panic as well.
        let estimator = state.estimator.take();
        let _ = caught(|| {
            drop(estimator);
            Ok(())
        });
    }

    fn lock(&self) -> MutexGuard<'_, State<E>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<E: Estimator> fmt::Debug for Node<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Node").field("path", &self.declaration.path).finish_non_exhaustive()
    }
}

/// What all running estimators have in common.
pub trait AnyNode {
    /// What it has counted.
    fn statistics(&self) -> EstimatorStatistics;
    /// Lets the estimator clean up and drops it; messages that still come are counted as dropped.
    fn terminate(&self);
}

impl<E: Estimator> AnyNode for Node<E> {
    fn statistics(&self) -> EstimatorStatistics {
        let stopped = self.lock().stopped.clone();
        self.counters.statistics(self.declaration, stopped)
    }

    fn terminate(&self) {
        let mut state = self.lock();
        if let Some(mut estimator) = state.estimator.take()
            && let Err(fault) = caught(move || {
                estimator.terminate();
                Ok(())
            })
        {
            self.stop(&mut state, &fault);
        }
    }
}
