//! The replacement of a declared component.

use std::any::Any;
use std::sync::Arc;

/// Creates a component that replaces another one; the lifecycle knows how.
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

    /// The constructor, if it is an `M`.
    pub(crate) fn make<M: 'static>(&self) -> Option<&M> {
        self.make.downcast_ref()
    }

    /// The name of its payload.
    pub(crate) fn payload(&self) -> &'static str {
        self.payload
    }
}
