//! Reports what happens to an actuator to the control state and to the log.

use super::{Inner, State};
use crate::component::Actuator;
use crate::declaration::ActuatorDeclaration;
use crate::event::{HardwareError, HardwareErrorKind};
use crate::node::Mode;
use crate::schedule::Lane;

/// Changes to report to the control state.
pub(super) enum Told {
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
            Mode::Real => self.environment.pool().submit(Lane::User, write),
            Mode::Virtual | Mode::Replay => state.told.push(Told::Log(Box::new(write))),
        }
    }

    pub(super) fn tell_control(&self, state: &mut State<A>, told: Told) {
        match self.environment.mode() {
            Mode::Real => self.tell_now(told),
            Mode::Virtual | Mode::Replay => state.told.push(told),
        }
    }

    pub(super) fn tell_now(&self, told: Told) {
        let ActuatorDeclaration { path, supervisor, .. } = *self.declaration;
        match told {
            Told::Failed { message, panicked } => {
                self.control.component_failed(path, supervisor, message, panicked)
            }
            Told::Unsafe(message) => {
                let error = HardwareError::new(HardwareErrorKind::NotMadeSafe, message);
                self.control.note_hardware_error(path, error);
            }
            Told::MessageFailed(message) => self.control.note_fault(path, message),
            Told::Log(write) => write(),
        }
    }
}
