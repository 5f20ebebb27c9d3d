//! Whether the handles of a command still work.

use super::Fault;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Given to a command with its context and revoked when it ends or is cancelled. Handles obtained through that
/// context then refuse to act, even if the command's code still runs.
#[derive(Clone, Debug, Default)]
pub(crate) struct Permit(Option<Arc<AtomicBool>>);

impl Permit {
    /// Of a component, whose handles always work.
    pub(crate) const UNLIMITED: Self = Self(None);

    /// Of one execution of a command.
    pub(crate) fn revocable() -> Self {
        Self(Some(Arc::default()))
    }

    pub(crate) fn revoke(&self) {
        if let Some(is_revoked) = &self.0 {
            is_revoked.store(true, Ordering::SeqCst);
        }
    }

    /// Whether both are of the same execution of a command.
    pub(crate) fn is_of_same(&self, other: &Self) -> bool {
        matches!((&self.0, &other.0), (Some(one), Some(other)) if Arc::ptr_eq(one, other))
    }

    /// # Errors
    /// It was revoked.
    pub(crate) fn check(&self) -> Result<(), Fault> {
        if self.is_valid() {
            return Ok(());
        }
        Err(Fault::new("the command that asks for this has ended or was cancelled"))
    }

    pub(crate) fn is_valid(&self) -> bool {
        self.0.as_ref().is_none_or(|is_revoked| !is_revoked.load(Ordering::SeqCst))
    }
}
