//! What is the same for all components of one start.

use super::{ComponentFault, StopSignal};
use crate::message::Origin;
use crate::time::Clock;
use std::sync::{Arc, Mutex, PoisonError};

/// What the components of a robot are started with.
#[derive(Clone, Debug)]
pub struct Startup {
    pub(super) clock: Clock,
    pub(super) origin: Origin,
    pub(super) stop: StopSignal,
    pub(super) faults: Faults,
}

impl Startup {
    pub(super) fn new(clock: Clock, robot: &'static str) -> Self {
        let origin = Origin { robot, node: "local" };
        Self { clock, origin, stop: StopSignal::default(), faults: Faults::default() }
    }

    pub(crate) fn clock(&self) -> &Clock {
        &self.clock
    }

    pub(crate) fn robot(&self) -> &'static str {
        self.origin.robot
    }

    pub(crate) fn origin(&self) -> Origin {
        self.origin
    }
}

/// The faults of sensors, and of what did not stop in time, in the order they came.
#[derive(Clone, Debug, Default)]
pub(super) struct Faults(Arc<Mutex<Vec<ComponentFault>>>);

impl Faults {
    pub(super) fn add(&self, path: &'static str, message: String) {
        tracing::error!(component = path, fault = message, "component stopped");
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(ComponentFault { path, message });
    }

    pub(super) fn all(&self) -> Vec<ComponentFault> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}
