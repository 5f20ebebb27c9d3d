//! What is the same for all components of one start.

use super::{ComponentFault, StartError, StopSignal, caught};
use crate::component::{Fault, Options};
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
    /// The first component that could not start; those behind it are not started any more.
    refusal: Arc<Mutex<Option<StartError>>>,
}

impl Startup {
    pub(super) fn new(clock: Clock, robot: &'static str) -> Self {
        let origin = Origin { robot, node: "local" };
        Self { clock, origin, stop: StopSignal::default(), faults: Faults::default(), refusal: Arc::default() }
    }

    /// Makes a component with validated options, unless another one could not start; if it cannot start either, that is
    /// kept.
    pub(crate) fn make<O: Options, C>(
        &self,
        path: &'static str,
        options: &O,
        make: impl FnOnce(O) -> Result<C, Fault>,
    ) -> Option<C> {
        let mut refusal = self.refusal.lock().unwrap_or_else(PoisonError::into_inner);
        if refusal.is_some() {
            return None;
        }
        let valid = options.validate().map_err(Fault::new);
        match valid.and_then(|()| caught(|| make(options.clone())).map_err(|failed| failed.fault)) {
            Ok(component) => Some(component),
            Err(fault) => {
                *refusal = Some(StartError::component(path, fault));
                None
            }
        }
    }

    /// What kept the robot from starting, if anything did.
    pub(super) fn refusal(&self) -> Option<StartError> {
        self.refusal.lock().unwrap_or_else(PoisonError::into_inner).take()
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
