//! Safety functions for any component.

use super::Fault;
use crate::event::HardwareError;
use std::fmt;
use std::sync::Arc;

/// Makes hardware safe.
pub(crate) type DisarmHook = Arc<dyn Fn() -> Result<(), Fault> + Send + Sync>;

/// Keeps disarm callbacks and records hardware errors; the runtime implements it.
pub(crate) trait Guardian: Send + Sync {
    /// Adds a callback of the component at `path`, or of that execution of the command there.
    fn on_disarm(&self, path: &'static str, execution: Option<u64>, hook: DisarmHook);
    fn hardware_error(&self, path: &'static str, error: HardwareError);
}

/// Registers disarm callbacks and reports hardware errors, for a component whose later calls get no context: an
/// estimator keeps the link from [`Context::safety`](super::Context::safety). Clones share it.
#[derive(Clone)]
pub struct SafetyLink {
    path: &'static str,
    guardian: Option<Arc<dyn Guardian>>,
}

impl SafetyLink {
    /// Creates a link. Without a guardian, as in tests, nothing happens.
    pub(crate) fn new(path: &'static str, guardian: Option<Arc<dyn Guardian>>) -> Self {
        Self { path, guardian }
    }

    /// Registers a callback that makes hardware safe when the robot is disarmed. All callbacks run concurrently, each
    /// on its own thread, and must return within 5 s. One that fails or takes longer leads to the safety state
    /// `error`. A restart of the component replaces its earlier callbacks. A `handle_options` that registers any
    /// replaces those of the previous `handle_options`, and keeps those of `init`.
    pub fn on_disarm(&self, hook: impl Fn() -> Result<(), Fault> + Send + Sync + 'static) {
        if let Some(guardian) = &self.guardian {
            guardian.on_disarm(self.path, None, Arc::new(hook));
        }
    }

    /// Reports that hardware is in a dangerous state: the robot is disarmed, its safety state becomes `error`, and the error
    /// is published at `safety/error`. Give a text, or a [`HardwareError`] with a kind and a quantity.
    pub fn hardware_error(&self, error: impl Into<HardwareError>) {
        if let Some(guardian) = &self.guardian {
            guardian.hardware_error(self.path, error.into());
        }
    }
}

impl fmt::Debug for SafetyLink {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("SafetyLink").field(&self.path).finish()
    }
}
