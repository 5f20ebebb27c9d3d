//! Whether the handles of a command still work.

use super::Fault;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Given to a command with its context and revoked when it ends or is cancelled. Handles obtained through that
/// context then refuse to act, even if the command's code still runs.
#[derive(Clone, Debug, Default)]
pub(crate) struct Permit(Option<Arc<AtomicUsize>>);

/// Set once the permit is revoked; the bits below count the threads that are acting.
const REVOKED: usize = 1 << (usize::BITS - 1);

/// A handle acts until this is dropped.
#[derive(Debug)]
pub(crate) struct Acting<'a>(Option<&'a AtomicUsize>);

impl Permit {
    /// Of a component, whose handles always work.
    pub(crate) const UNLIMITED: Self = Self(None);

    /// Of one execution of a command.
    pub(crate) fn revocable() -> Self {
        Self(Some(Arc::default()))
    }

    pub(crate) fn revoke(&self) {
        if let Some(state) = &self.0 {
            state.fetch_or(REVOKED, Ordering::SeqCst);
        }
    }

    /// Begins an action, which lasts until the returned value is dropped. Returns `None` if the permit was revoked;
    /// otherwise the action has begun before any revocation.
    pub(crate) fn act(&self) -> Option<Acting<'_>> {
        let Some(state) = &self.0 else { return Some(Acting(None)) };
        let acting = Acting(Some(state));
        let before = state.fetch_add(1, Ordering::SeqCst);
        (before & REVOKED == 0).then_some(acting)
    }

    /// Whether an action that began before the permit was revoked is still in progress.
    pub(crate) fn is_acting(&self) -> bool {
        self.0.as_ref().is_some_and(|state| state.load(Ordering::SeqCst) & !REVOKED > 0)
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
        self.0.as_ref().is_none_or(|state| state.load(Ordering::SeqCst) & REVOKED == 0)
    }
}

impl Drop for Acting<'_> {
    fn drop(&mut self) {
        if let Some(state) = self.0 {
            state.fetch_sub(1, Ordering::SeqCst);
        }
    }
}
