//! The time during which a caller may act, and the calls that are being carried out in it.
//!
//! What is revoked must not act afterwards, and a call whose code hangs must block no other thread for good. So a call holds a permit from its
//! last check until it has acted. To end a tenure is one atomic step, which comes before or after that check and waits for nothing: it is also done
//! under the lock of the control state. Those who need to know that nothing acts any more wait for the permits that are held,
//! with a time limit, and not for those of their own thread, since a call may end the tenure that it is made in.

#[cfg(all(test, loom))]
mod model;
#[cfg(all(test, not(loom)))]
mod tests;

use crate::fault::{Place, enter, leave, times_inside};
#[cfg(loom)]
use loom::sync::{Condvar, Mutex, atomic::AtomicUsize};
use std::marker::PhantomData;
use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError};
#[cfg(not(loom))]
use std::sync::{Condvar, Mutex, atomic::AtomicUsize};
use std::time::{Duration, Instant};

/// Set in [`Tenure::state`] once it is over.
const OVER: usize = 1;
/// A permit in [`Tenure::state`].
const PERMIT: usize = 2;

/// An execution of a command, or a session.
#[derive(Debug, Default)]
pub(super) struct Tenure {
    /// The permits that are held, and whether it is over.
    state: AtomicUsize,
    /// Notified when a permit is given back after the end.
    idle: Mutex<()>,
    changed: Condvar,
    /// The name of a session.
    session: Option<String>,
    /// The execution or session in which a session was begun.
    outer: Option<Arc<Tenure>>,
}

/// A tenure that is over.
#[derive(Clone, Copy, Debug)]
pub(super) struct Over<'a> {
    /// Name of a session; `None` for an execution of a command.
    pub(super) session: Option<&'a str>,
}

impl Tenure {
    /// A session of that name, within another tenure if there is one.
    pub(super) fn session(name: String, outer: Option<Arc<Self>>) -> Self {
        Self { session: Some(name), outer, ..Self::default() }
    }

    /// The innermost that is over.
    pub(super) fn over(&self) -> Option<Over<'_>> {
        if self.state.load(Ordering::SeqCst) & OVER != 0 {
            Some(Over { session: self.session.as_deref() })
        } else {
            self.outer.as_deref().and_then(Self::over)
        }
    }

    pub(super) fn outermost(&self) -> &Self {
        self.outer.as_deref().map_or(self, Self::outermost)
    }

    /// Permits the calling thread to act until the permit is dropped.
    ///
    /// # Errors
    /// The innermost that is over.
    pub(super) fn permit(&self) -> Result<Permit<'_>, Over<'_>> {
        self.enter()?;
        Ok(Permit { tenure: Some(self), _on_one_thread: PhantomData })
    }

    fn enter(&self) -> Result<(), Over<'_>> {
        let one_more = |state: usize| (state & OVER == 0).then_some(state + PERMIT);
        if self.state.fetch_update(Ordering::SeqCst, Ordering::SeqCst, one_more).is_err() {
            return Err(Over { session: self.session.as_deref() });
        }
        // Before anything that may fail, so that `leave` finds it.
        enter(self.place());
        if let Some(outer) = &self.outer
            && let Err(over) = outer.enter()
        {
            self.leave_this();
            return Err(over);
        }
        Ok(())
    }

    fn leave(&self) {
        if let Some(outer) = &self.outer {
            outer.leave();
        }
        self.leave_this();
    }

    fn leave_this(&self) {
        leave(self.place());
        let before = self.state.fetch_sub(PERMIT, Ordering::SeqCst);
        if before & OVER != 0 {
            // A thread that waits has seen the permit under this lock, or will see that it is gone.
            drop(self.idle.lock().unwrap_or_else(PoisonError::into_inner));
            self.changed.notify_all();
        }
    }

    /// Gives no permit from now on, in it and within it.
    pub(super) fn end(&self) {
        self.state.fetch_or(OVER, Ordering::SeqCst);
    }

    /// Waits until no other thread holds a permit, in it or within it, at most `timeout`. Returns whether none does.
    pub(super) fn wait(&self, timeout: Duration) -> bool {
        // A time that far away is never reached.
        let deadline = Instant::now().checked_add(timeout);
        let place = self.place();
        let own = times_inside(|other| other == place);
        let mut idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        while self.state.load(Ordering::SeqCst) / PERMIT > own {
            let left = match deadline {
                Some(deadline) => deadline.saturating_duration_since(Instant::now()),
                None => timeout,
            };
            if left.is_zero() {
                return false;
            }
            idle = match self.changed.wait_timeout(idle, left) {
                Ok((idle, _)) => idle,
                Err(poisoned) => poisoned.into_inner().0,
            };
        }
        true
    }

    fn place(&self) -> Place {
        Place::Permit(std::ptr::from_ref(self).addr())
    }
}

/// The right of the thread that holds it to act now, in a tenure and in those around it.
#[derive(Debug)]
pub(crate) struct Permit<'a> {
    /// `None` for a caller without an end.
    tenure: Option<&'a Tenure>,
    /// Keeps the permit on its thread: each thread knows its own.
    _on_one_thread: PhantomData<*const ()>,
}

impl Permit<'_> {
    /// The permit of a caller without an end.
    pub(super) const ENDLESS: Self = Self { tenure: None, _on_one_thread: PhantomData };
}

impl Drop for Permit<'_> {
    fn drop(&mut self) {
        if let Some(tenure) = self.tenure {
            tenure.leave();
        }
    }
}
