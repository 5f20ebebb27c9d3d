//! Calls user code, and turns a panic into a value.

use super::Fault;
use std::any::Any;
use std::mem::needs_drop;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::task::Waker;

/// The value carried by a panic.
pub(crate) type Panic = Box<dyn Any + Send>;

/// A failed call of user code.
pub(crate) struct Failed {
    pub(crate) fault: Fault,
    /// `true` if the code panicked, and may have left its data inconsistent.
    pub(crate) panicked: bool,
}

impl From<Fault> for Failed {
    fn from(fault: Fault) -> Self {
        Self { fault, panicked: false }
    }
}

/// Calls user code; a panic in it becomes a fault.
#[inline]
pub(crate) fn caught<T>(call: impl FnOnce() -> Result<T, Fault>) -> Result<T, Failed> {
    match catch_unwind(AssertUnwindSafe(call)) {
        Ok(result) => result.map_err(Failed::from),
        Err(panic) => Err(Failed { fault: of_panic(panic), panicked: true }),
    }
}

/// Calls code that returns no fault, and turns a panic into a fault.
pub(crate) fn guarded(call: impl FnOnce()) -> Result<(), Fault> {
    catch_unwind(AssertUnwindSafe(call)).map_err(of_panic)
}

/// Locks a mutex, also after a panic of code that held it.
#[inline]
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Logs a panic of code that no component is charged with. The logger may panic as well.
pub(crate) fn log_panic(what: &'static str, fault: &Fault) {
    // There is nobody else to tell.
    let _ = guarded(|| tracing::error!(%fault, "{what}"));
}

/// Drops a user's value and catches a panic of its `Drop`.
#[inline]
pub(crate) fn discard<T>(value: T) {
    if needs_drop::<T>()
        && let Err(fault) = guarded(|| drop(value))
    {
        log_panic("a value panicked when it was dropped", &fault);
    }
}

/// Wakes a task. A panic in a user's waker must not end the thread that wakes it; then this returns false.
pub(crate) fn wake(waker: Waker) -> bool {
    let woken = guarded(|| waker.wake());
    if let Err(fault) = &woken {
        log_panic("a waker failed", fault);
    }
    woken.is_ok()
}

/// Closes and drops a component; one that has panicked is dropped without being closed. Returns what went wrong.
pub(crate) fn retire<C>(mut component: C, panicked: bool, close: impl FnOnce(&mut C)) -> Option<Fault> {
    let closed = if panicked { Ok(()) } else { guarded(|| close(&mut component)) };
    let dropped = guarded(|| drop(component));
    closed.and(dropped).err()
}

/// The message of a panic.
#[cold]
pub(crate) fn of_panic(panic: Panic) -> Fault {
    let message = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    let message = message.or_else(|| panic.downcast_ref::<String>().cloned());
    Fault::new(format!("panicked: {}", message.as_deref().unwrap_or("no message")))
}
