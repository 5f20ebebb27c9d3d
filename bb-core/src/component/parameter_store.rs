//! The contract of a store that keeps parameters across restarts.

use super::Fault;
use crate::event::ParameterValue;
use std::collections::BTreeMap;

/// Keeps the values of parameters across restarts of the program, see
/// [`Builder::keep_parameters`](crate::Builder::keep_parameters).
///
/// Its methods are called by one thread at a time and may block. An implementation must be crash-safe: a store that is killed
/// while it writes contains the last complete set when it is opened again. `bb-redb` is such a store in a file.
///
/// ```
/// use bb_core::event::ParameterValue;
/// use bb_core::prelude::*;
/// use bb_core::component::ParameterStore;
/// use std::collections::BTreeMap;
/// use std::sync::{Arc, Mutex, PoisonError};
///
/// /// Keeps them in memory, for a test.
/// #[derive(Clone, Debug, Default)]
/// struct Memory(Arc<Mutex<BTreeMap<String, ParameterValue>>>);
///
/// impl ParameterStore for Memory {
///     fn load(&mut self) -> Result<BTreeMap<String, ParameterValue>, Fault> {
///         Ok(self.0.lock().unwrap_or_else(PoisonError::into_inner).clone())
///     }
///
///     fn store(&mut self, values: &BTreeMap<String, ParameterValue>) -> Result<(), Fault> {
///         *self.0.lock().unwrap_or_else(PoisonError::into_inner) = values.clone();
///         Ok(())
///     }
/// }
///
/// robot! {
///     robot Rig;
///     parameters { kp: f64 = 1.0; }
///     link base;
/// }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let memory = Memory::default();
/// let mut builder = Rig::builder();
/// builder.keep_parameters(memory.clone())?;
/// let simulation = builder.simulate()?;
/// simulation.set_parameter(rig::param::kp, 4.5)?;
/// simulation.stop();
///
/// // The next run.
/// let mut builder = Rig::builder();
/// builder.keep_parameters(memory)?;
/// assert_eq!(builder.simulate()?.parameter(rig::param::kp), 4.5);
/// # Ok(())
/// # }
/// ```
pub trait ParameterStore: Send + 'static {
    /// The set of values stored last, by path; empty if none was stored.
    ///
    /// # Errors
    /// The reason for which it cannot be read.
    fn load(&mut self) -> Result<BTreeMap<String, ParameterValue>, Fault>;

    /// Stores a set of values in place of the last one, as a whole. When it returns, the set is durable.
    ///
    /// # Errors
    /// The reason for which it was not stored; the last set remains. It is reported as a fault at `param`, and storing is tried again
    /// with the next change and when the robot stops. A simulation stores when it stops, and tries again once.
    fn store(&mut self, values: &BTreeMap<String, ParameterValue>) -> Result<(), Fault>;
}
