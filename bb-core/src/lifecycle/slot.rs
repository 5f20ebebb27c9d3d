//! The slot of one component, with its lifecycle.

use super::backoff::{Failures, Supervision};
use super::{Component, backoff};
use crate::component::{Binding, Options};
use crate::declaration::ParameterValues;
use crate::fault::{Failed, Fault, Termination, Then, caught, discard, retire};
use crate::time::MonotonicTime;

/// The options and the context from which a component is created, at the start and at every restart.
pub(crate) struct Recipe<O> {
    /// An error if they could not be copied; it keeps the robot from starting.
    options: Result<O, String>,
    binding: Binding<O>,
}

impl<O: Options> Recipe<O> {
    pub(crate) fn new(options: &O, binding: Binding<O>) -> Self {
        let options = caught(|| Ok(options.clone())).map_err(|failed| failed.fault.to_string());
        Self { options, binding }
    }

    /// The options with the values of parameters, validated.
    fn bound(&self, parameters: &ParameterValues) -> Result<O, Fault> {
        let options = self.options.as_ref().map_err(|message| Fault::new(message.clone()))?;
        self.binding.bound(options, parameters).map_err(Fault::new)
    }
}

/// Slot of a component, see the [module](super).
pub(crate) struct Slot<C: Component> {
    recipe: Recipe<C::Options>,
    state: State<C>,
    failures: Failures,
    supervision: Supervision,
}

enum State<C> {
    /// Not created yet, or retired.
    Vacant,
    Running(C),
    /// The component has failed, and will be restarted at that time.
    Waiting(MonotonicTime),
    /// The component remains stopped.
    Stopped,
}

/// The consequence of a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum AfterFault {
    /// A restart at that time.
    RestartAt(MonotonicTime),
    /// No restart: it remains stopped.
    Stopped,
}

impl<C: Component> Slot<C> {
    pub(crate) fn new(recipe: Recipe<C::Options>, supervision: backoff::Supervision) -> Self {
        Self { recipe, state: State::Vacant, failures: Failures::default(), supervision }
    }

    #[inline]
    pub(crate) fn running(&mut self) -> Option<&mut C> {
        match &mut self.state {
            State::Running(component) => Some(component),
            _ => None,
        }
    }

    #[inline]
    pub(crate) fn is_running(&self) -> bool {
        matches!(self.state, State::Running(_))
    }

    /// Returns the time of a pending restart, if there is one.
    pub(crate) fn restart_at(&self) -> Option<MonotonicTime> {
        match self.state {
            State::Waiting(at) => Some(at),
            _ => None,
        }
    }

    /// Creates it; the previous one has been retired. After an error it is vacant, and the caller either calls
    /// [`Self::fail`] or prevents the robot from starting.
    pub(crate) fn make(&mut self, context: &C::Context, parameters: &ParameterValues) -> Result<(), Failed> {
        debug_assert!(!self.is_running(), "a component is retired before the next one is created");
        self.state = State::Vacant;
        let made = caught(|| C::make(|| self.recipe.bound(parameters), context))?;
        self.state = State::Running(made);
        Ok(())
    }

    /// Passes new options to it. `Ok(false)`: it must be restarted with them.
    pub(crate) fn change(&mut self, context: &C::Context, parameters: &ParameterValues) -> Result<bool, Failed> {
        let State::Running(component) = &mut self.state else { return Ok(true) };
        let changed = caught(|| component.change(|| self.recipe.bound(parameters), context));
        match changed {
            Ok(()) => Ok(true),
            Err(failed) if failed.fault.then == Then::Remake => Ok(false),
            Err(failed) => Err(failed),
        }
    }

    /// Retires a component that has failed at `now`; it is restarted after its backoff unless the fault is permanent.
    pub(crate) fn fail(&mut self, failed: &Failed, now: MonotonicTime) -> AfterFault {
        let previous = std::mem::replace(&mut self.state, State::Stopped);
        if let State::Running(component) = previous {
            // The fault is known; later errors follow from it.
            let _ =
                retire(component, failed.panicked, |component| component.close(Termination::Fault(&failed.fault)));
        }
        match failed.fault.then {
            Then::Restart | Then::Remake => {
                let at = self.failures.add(now, &self.supervision);
                self.state = State::Waiting(at);
                AfterFault::RestartAt(at)
            }
            Then::Stay | Then::Skip => AfterFault::Stopped,
        }
    }

    /// Retires it for a restart, though it has not failed; false if it did not run.
    pub(crate) fn restart(&mut self, now: MonotonicTime, reason: Termination<'_>) -> bool {
        if !self.is_running() {
            return false;
        }
        // An error while it closes does not concern the next one.
        let _ = self.retire(reason);
        self.state = State::Waiting(now);
        true
    }

    /// Ends restarts, since the supervisor gives up.
    pub(crate) fn give_up(&mut self) {
        if matches!(self.state, State::Waiting(_)) {
            self.state = State::Stopped;
        }
    }

    /// Leaves it out.
    pub(crate) fn stop(&mut self) {
        self.state = State::Stopped;
    }

    /// Closes and drops it; returns what went wrong.
    pub(crate) fn retire(&mut self, reason: Termination<'_>) -> Option<Fault> {
        match std::mem::replace(&mut self.state, State::Vacant) {
            State::Running(component) => retire(component, false, |component| component.close(reason)),
            _ => None,
        }
    }
}

impl<C: Component> Drop for Slot<C> {
    /// Retires the component of a robot that did not start. The `Drop` of the options is code of the user, too.
    fn drop(&mut self) {
        let _ = self.retire(Termination::Stop);
        discard(std::mem::replace(&mut self.recipe.options, Err(String::new())));
    }
}
