//! Reports what happens to an actuator to the control state and to the log.

use super::{Inner, State};
use crate::component::Actuator;
use crate::declaration::ActuatorDeclaration;
use crate::event::{HardwareError, HardwareErrorKind};
use crate::node::Mode;
use crate::schedule::Lane;

/// Changes to report to the control state.
pub(super) enum Change {
    Failed {
        message: String,
        panicked: bool,
    },
    Unsafe(String),
    MessageFailed(String),
    /// A line for the log. A logger may block, and disarming needs the lock.
    Log(Box<dyn FnOnce() + Send>),
}

impl<A: Actuator> Inner<A> {
    pub(super) fn log(&self, state: &mut State<A>, write: impl FnOnce() + Send + 'static) {
        match self.environment.mode() {
            Mode::Real => {
                let control = self.control.clone();
                self.environment.pool().submit(Lane::User, move || control.log(write));
            }
            Mode::Virtual | Mode::Replay => state.pending.push(Change::Log(Box::new(write))),
        }
    }

    pub(super) fn tell_control(&self, state: &mut State<A>, change: Change) {
        match self.environment.mode() {
            Mode::Real => self.tell_now(change),
            Mode::Virtual | Mode::Replay => state.pending.push(change),
        }
    }

    pub(super) fn tell_now(&self, change: Change) {
        let ActuatorDeclaration { path, supervisor, .. } = *self.declaration;
        match change {
            Change::Failed { message, panicked } => {
                self.control.component_failed(path, supervisor, message, panicked)
            }
            Change::Unsafe(message) => {
                let error = HardwareError::new(HardwareErrorKind::NotMadeSafe, message);
                self.control.note_hardware_error(path, error);
            }
            Change::MessageFailed(message) => drop(self.control.note_fault(path, message)),
            Change::Log(write) => self.control.log(write),
        }
    }
}
