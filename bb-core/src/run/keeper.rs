//! Keeps parameters over restarts: hands each set of values to the store, on a thread of its own.

use crate::component::{Fault, ParameterStore};
use crate::control::Control;
use crate::event::ParameterValue;
use crate::fault::{caught, discard, guarded, lock, log_panic};
use crate::schedule::start_thread;
use bb_message::__private::Sorted;
use std::collections::BTreeMap;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// The path at which faults of a store are reported.
pub(super) const PATH: &str = "param";

/// Time that the last set may take to be stored when the robot stops.
const STORED_WITHIN: Duration = Duration::from_secs(2);

/// A store, with the values that it has.
pub(super) struct Kept {
    store: Box<dyn ParameterStore>,
    values: BTreeMap<String, ParameterValue>,
    desk: Arc<Desk>,
}

/// Changed parameters, left for the thread of the store.
#[derive(Default)]
pub(super) struct Desk {
    state: Mutex<State>,
    turned: Condvar,
}

#[derive(Default)]
struct State {
    /// Values that were set since the last look, by the number of the parameter.
    changed: Sorted<usize, ParameterValue>,
    /// The thread has yet to look.
    is_due: bool,
    /// The thread is to end.
    is_closed: bool,
    /// The thread has ended.
    has_ended: bool,
}

impl Desk {
    /// Changes the state, and wakes those who wait for it.
    fn turn(&self, change: impl FnOnce(&mut State)) {
        change(&mut lock(&self.state));
        self.turned.notify_all();
    }
}

/// A store at work.
pub(super) enum Keeper {
    /// A store on a thread of its own.
    Apart(Arc<Desk>),
    /// A store on virtual time: all user code runs on the caller's thread, and everything is stored at the end.
    Here(Box<Work>),
}

impl Kept {
    /// Reads what the store has.
    pub(super) fn load(mut store: Box<dyn ParameterStore>) -> Result<Self, Fault> {
        let values = caught(|| store.load()).map_err(|failed| failed.fault)?;
        Ok(Self { store, values, desk: Arc::default() })
    }

    /// The stored values, by path.
    pub(super) fn values(&self) -> &BTreeMap<String, ParameterValue> {
        &self.values
    }

    /// Notes what is set from now on: components may set parameters in their first `init`.
    pub(super) fn note(&self, control: &Control) {
        let desk = Arc::clone(&self.desk);
        control.on_parameters(move |changes| {
            desk.turn(|state| {
                for change in changes {
                    state.changed.insert(change.parameter, change.value.clone());
                }
                state.is_due = true;
            });
        });
    }
}

impl Keeper {
    /// Starts to keep what is set.
    pub(super) fn start(kept: Kept, control: &Control) -> Result<Self, Fault> {
        let Kept { store, values, desk } = kept;
        let work = Work { store, values, desk: Arc::clone(&desk), control: control.clone() };
        if control.is_virtual() {
            return Ok(Self::Here(Box::new(work)));
        }
        let watched = Arc::clone(&desk);
        let run = move || {
            // The store is closed with `work`.
            if let Err(fault) = guarded(|| work.run()) {
                log_panic("the store of parameters failed as it was closed", &fault);
            }
            watched.turn(|state| state.has_ended = true);
        };
        start_thread(PATH, Box::new(run))?;
        Ok(Self::Apart(desk))
    }

    /// Waits until everything is stored, at most until `deadline`.
    pub(super) fn finish(mut self, control: &Control, deadline: Instant) {
        match &mut self {
            Self::Here(work) => {
                let is_stored = work.store_rest(true);
                work.store_rest(is_stored);
            }
            Self::Apart(desk) => {
                desk.turn(|state| state.is_closed = true);
                let left = deadline.saturating_duration_since(Instant::now()).min(STORED_WITHIN);
                let waited = desk.turned.wait_timeout_while(lock(&desk.state), left, |state| !state.has_ended);
                if !waited.unwrap_or_else(PoisonError::into_inner).0.has_ended {
                    control.note_fault(PATH, "the store of parameters did not return in time".to_owned());
                }
            }
        }
        discard(self);
    }
}

impl Drop for Keeper {
    fn drop(&mut self) {
        if let Self::Apart(desk) = self {
            desk.turn(|state| state.is_closed = true);
        }
    }
}

/// A store, its values and the sets that wait for it, see [`Keeper`].
pub(super) struct Work {
    store: Box<dyn ParameterStore>,
    values: BTreeMap<String, ParameterValue>,
    desk: Arc<Desk>,
    control: Control,
}

impl Work {
    fn run(mut self) {
        let mut is_stored = true;
        loop {
            let idle = |state: &mut State| !state.is_due && !state.is_closed;
            let desk = Arc::clone(&self.desk);
            let mut state = desk.turned.wait_while(lock(&desk.state), idle).unwrap_or_else(PoisonError::into_inner);
            if !std::mem::take(&mut state.is_due) {
                break;
            }
            drop(state);
            is_stored = self.store();
        }
        self.store_rest(is_stored);
    }

    /// Stores a change that came with the end, or one that was not stored before. Whether all is stored then.
    fn store_rest(&mut self, is_stored: bool) -> bool {
        if is_stored && lock(&self.desk.state).changed.is_empty() { true } else { self.store() }
    }

    fn store(&mut self) -> bool {
        let changed = std::mem::take(&mut lock(&self.desk.state).changed);
        for (number, value) in changed.into_entries() {
            if let Some(path) = self.control.parameter_path(number) {
                self.values.insert(path.to_owned(), value);
            }
        }
        let Self { store, values, .. } = self;
        match caught(|| store.store(values)) {
            Ok(()) => true,
            Err(failed) => {
                self.control.note_fault(PATH, format!("the parameters are not stored: {}", failed.fault));
                false
            }
        }
    }
}
