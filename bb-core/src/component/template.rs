//! Options that any thread can copy.

use super::{Binding, Options};
use crate::declaration::ParameterValues;
use crate::fault::{Fault, caught, lock};
use std::sync::Mutex;

/// Options for any thread: they are `Send`, but need not be `Sync`.
pub(crate) struct Template<O>(Mutex<O>);

impl<O: Options> Template<O> {
    /// A copy of `options`; an error if their `clone` panics.
    pub(crate) fn new(options: &O) -> Result<Self, Fault> {
        let options = caught(|| Ok(options.clone())).map_err(|failed| failed.fault)?;
        Ok(Self(Mutex::new(options)))
    }

    /// The options with the parameter values applied and validated; the error says why not.
    pub(crate) fn bound(&self, binding: &Binding<O>, values: &ParameterValues) -> Result<O, String> {
        let options = lock(&self.0);
        let bound = caught(|| binding.bound(&options, values).map_err(Fault::new));
        bound.map_err(|failed| failed.fault.to_string())
    }
}
