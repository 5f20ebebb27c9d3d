//! What takes the place of a declared component.

use std::any::Any;
use std::sync::Arc;

/// Makes a component that takes the place of another one; the lifecycle knows how.
#[derive(Clone)]
pub(crate) struct Replacement {
    make: Arc<dyn Any + Send + Sync>,
    /// The name of its payload.
    payload: &'static str,
}

impl Replacement {
    pub(crate) fn new(make: impl Any + Send + Sync, payload: &'static str) -> Self {
        Self { make: Arc::new(make), payload }
    }

    /// What makes it, if that is an `M`.
    pub(crate) fn make<M: 'static>(&self) -> Option<&M> {
        self.make.downcast_ref()
    }

    /// The name of its payload.
    pub(crate) fn payload(&self) -> &'static str {
        self.payload
    }
}
