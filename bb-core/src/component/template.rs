//! Options that any thread can copy.

use super::{Binding, Options};
use crate::declaration::ParameterValues;
use crate::fault::{Fault, caught};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Options for any thread. They are `Send` but need not be `Sync`, and their code (`clone`, `validate`) is the
/// user's. One thread at a time holds them, without a lock, and a thread that waits for one that hangs gives up.
pub(crate) struct Template<O> {
    /// `None` while a thread holds them.
    options: Mutex<Option<O>>,
    returned: Condvar,
}

/// How long a thread waits for another one that holds them.
const LONGEST_WAIT: Duration = Duration::from_secs(1);

impl<O: Options> Template<O> {
    /// A copy of `options`; an error if their `clone` panics.
    pub(crate) fn new(options: &O) -> Result<Self, Fault> {
        let options = caught(|| Ok(options.clone())).map_err(|failed| failed.fault)?;
        Ok(Self { options: Mutex::new(Some(options)), returned: Condvar::new() })
    }

    /// The options with the parameter values applied and validated; the error says why not.
    pub(crate) fn bound(&self, binding: &Binding<O>, values: &ParameterValues) -> Result<O, String> {
        let taken = Taken { options: self.take(), template: self };
        let Some(options) = &taken.options else {
            return Err("the code of its options has not returned on another thread".to_owned());
        };
        let bound = caught(|| binding.bound(options, values).map_err(Fault::new));
        bound.map_err(|failed| failed.fault.to_string())
    }

    fn take(&self) -> Option<O> {
        let options = self.lock();
        let waited = self.returned.wait_timeout_while(options, LONGEST_WAIT, |options| options.is_none());
        waited.unwrap_or_else(PoisonError::into_inner).0.take()
    }
}

impl<O> Template<O> {
    fn lock(&self) -> MutexGuard<'_, Option<O>> {
        self.options.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Gives them back.
struct Taken<'a, O> {
    options: Option<O>,
    template: &'a Template<O>,
}

impl<O> Drop for Taken<'_, O> {
    fn drop(&mut self) {
        if let Some(options) = self.options.take() {
            *self.template.lock() = Some(options);
            self.template.returned.notify_one();
        }
    }
}
