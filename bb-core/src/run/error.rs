//! What goes wrong with components, as values.

use crate::component::Fault;
use std::any::Any;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, PoisonError};
use std::task::Waker;

/// Why a robot does not start: which component, and what keeps it. `Debug` prints the same as `Display`, since that is
/// what a `main` that returns it shows.
pub struct StartError {
    path: &'static str,
    fault: Fault,
}

impl StartError {
    pub(crate) fn component(path: &'static str, fault: Fault) -> Self {
        Self { path, fault }
    }

    /// The path of the component.
    pub fn path(&self) -> &'static str {
        self.path
    }

    /// What keeps it from starting.
    pub fn fault(&self) -> &Fault {
        &self.fault
    }
}

impl fmt::Display for StartError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} cannot start: {}", self.path, self.fault)
    }
}

impl fmt::Debug for StartError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl std::error::Error for StartError {}

/// A component that has failed by a fault of its own, while the robot runs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ComponentFault {
    /// The path of the component.
    pub path: &'static str,
    /// What happened.
    pub message: String,
}

impl fmt::Display for ComponentFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} failed: {}", self.path, self.message)
    }
}

impl std::error::Error for ComponentFault {}

/// Faults that are kept; of more only the number is.
const KEPT: usize = 256;

/// The faults of components, in the order they came.
#[derive(Clone, Debug, Default)]
pub(super) struct Faults(Arc<Mutex<(Vec<ComponentFault>, u64)>>);

impl Faults {
    pub(super) fn add(&self, path: &'static str, message: String) {
        tracing::error!(component = path, fault = message, "component failed");
        let mut faults = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        faults.1 += 1;
        if faults.0.len() < KEPT {
            faults.0.push(ComponentFault { path, message });
        }
    }

    /// The first ones, and how many there were.
    pub(super) fn all(&self) -> (Vec<ComponentFault>, u64) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// What a user's code did instead of what it was called for.
pub(crate) struct Failed {
    pub(crate) fault: Fault,
    /// It panicked, and may have left anything half done.
    pub(crate) panicked: bool,
}

/// Calls a user's code; a panic in it becomes a fault.
#[inline]
pub(crate) fn caught<T>(call: impl FnOnce() -> Result<T, Fault>) -> Result<T, Failed> {
    match catch_unwind(AssertUnwindSafe(call)) {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(fault)) => Err(Failed { fault, panicked: false }),
        Err(panic) => Err(Failed { fault: of_panic(&*panic), panicked: true }),
    }
}

/// Wakes whoever waits. What a user's waker does belongs to nobody here: a panic in it must not end the thread that wakes.
pub(crate) fn wake(waker: Waker) {
    let woken = caught(|| {
        waker.wake();
        Ok(())
    });
    if let Err(failed) = woken {
        tracing::error!(fault = %failed.fault, "a waker failed");
    }
}

/// Lets a component clean up and drops it, whatever it does meanwhile; one that has panicked is dropped as it is. Gives
/// what went wrong.
pub(crate) fn retire<C>(mut component: C, panicked: bool, terminate: impl FnOnce(&mut C)) -> Option<Fault> {
    let terminated = if panicked {
        Ok(())
    } else {
        caught(|| {
            terminate(&mut component);
            Ok(())
        })
    };
    let dropped = caught(|| {
        drop(component);
        Ok(())
    });
    terminated.and(dropped).err().map(|failed| failed.fault)
}

#[cold]
fn of_panic(panic: &(dyn Any + Send)) -> Fault {
    let message = panic.downcast_ref::<&str>().copied();
    let message = message.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    Fault::new(format!("panicked: {}", message.unwrap_or("no message")))
}
