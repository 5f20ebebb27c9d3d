//! Keeps parameters over restarts: hands each set of values to the store, on a thread of its own.

use crate::component::{Fault, ParameterStore};
use crate::control::Control;
use crate::event::ParameterValue;
use crate::fault::{caught, discard, guarded};
use std::collections::BTreeMap;
use std::fmt;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, channel, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// The path at which faults of a store are reported.
pub(super) const PATH: &str = "param";

/// How long the last set may take to be stored when the robot stops.
const STORED_WITHIN: Duration = Duration::from_secs(2);

/// A store, with the values that it has.
pub(super) struct Kept {
    store: Box<dyn ParameterStore>,
    values: BTreeMap<String, ParameterValue>,
    changed: Changed,
    wake: Arc<Mutex<Option<SyncSender<()>>>>,
    woken: Receiver<()>,
}

/// Values that were set since the last look, by the number of the parameter.
type Changed = Arc<Mutex<BTreeMap<usize, ParameterValue>>>;

/// A store at work.
pub(super) enum Keeper {
    /// On a thread of its own.
    Apart {
        /// Wakes the thread; it ends once this is empty.
        wake: Arc<Mutex<Option<SyncSender<()>>>>,
        /// Closed when the thread has ended.
        ended: Receiver<()>,
    },
    /// On virtual time all user code runs on the caller's thread: everything is stored at the end.
    Here(Box<Work>),
}

impl Kept {
    /// Reads what the store has.
    pub(super) fn load(mut store: Box<dyn ParameterStore>) -> Result<Self, Fault> {
        let values = caught(|| store.load()).map_err(|failed| failed.fault)?;
        let (sender, woken) = sync_channel(1);
        Ok(Self { store, values, changed: Changed::default(), wake: Arc::new(Mutex::new(Some(sender))), woken })
    }

    /// The stored values, by path.
    pub(super) fn values(&self) -> &BTreeMap<String, ParameterValue> {
        &self.values
    }

    /// Notes what is set from now on: components may set parameters in their first `init`.
    pub(super) fn note(&self, control: &Control) {
        let (changed, wake) = (Arc::clone(&self.changed), Arc::clone(&self.wake));
        control.on_parameters(move |changes| {
            lock(&changed).extend(changes.iter().map(|change| (change.parameter, change.value.clone())));
            if let Some(sender) = &*lock(&wake) {
                // If it is full, the thread has yet to look.
                let _ = sender.try_send(());
            }
        });
    }
}

impl Keeper {
    /// Starts to keep what is set.
    pub(super) fn start(kept: Kept, control: &Control) -> Result<Self, Fault> {
        let Kept { store, values, changed, wake, woken } = kept;
        let work = Work { store, values, changed, control: control.clone() };
        if control.is_virtual() {
            return Ok(Self::Here(Box::new(work)));
        }
        let (end, ended) = channel::<()>();
        let run = move || {
            // The store is closed with `work`.
            if let Err(fault) = guarded(|| work.run(&woken)) {
                tracing::error!(%fault, "the store of parameters failed as it was closed");
            }
            drop(end);
        };
        std::thread::Builder::new().name(PATH.to_owned()).spawn(run).map_err(Fault::from)?;
        Ok(Self::Apart { wake, ended })
    }

    /// Waits until everything is stored, at most until `deadline`.
    pub(super) fn finish(mut self, control: &Control, deadline: Instant) {
        match &mut self {
            Self::Here(work) => {
                let is_stored = work.store_rest(true);
                work.store_rest(is_stored);
            }
            Self::Apart { wake, ended } => {
                drop(lock(wake).take());
                let left = deadline.saturating_duration_since(Instant::now()).min(STORED_WITHIN);
                if ended.recv_timeout(left) == Err(RecvTimeoutError::Timeout) {
                    control.note_fault(PATH, "the store of parameters did not return in time".to_owned());
                }
            }
        }
        discard(self);
    }
}

impl Drop for Keeper {
    /// The thread owns the control state, which owns the callback that wakes the thread.
    fn drop(&mut self) {
        if let Self::Apart { wake, .. } = self {
            drop(lock(wake).take());
        }
    }
}

/// See [`Keeper`].
pub(super) struct Work {
    store: Box<dyn ParameterStore>,
    values: BTreeMap<String, ParameterValue>,
    changed: Changed,
    control: Control,
}

impl Work {
    fn run(mut self, woken: &Receiver<()>) {
        let mut is_stored = true;
        while woken.recv().is_ok() {
            is_stored = self.store();
        }
        self.store_rest(is_stored);
    }

    /// Stores a change that came with the end, or one that was not stored before. Whether all is stored then.
    fn store_rest(&mut self, is_stored: bool) -> bool {
        if is_stored && lock(&self.changed).is_empty() { true } else { self.store() }
    }

    fn store(&mut self) -> bool {
        for (number, value) in std::mem::take(&mut *lock(&self.changed)) {
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

impl fmt::Debug for Keeper {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Keeper").finish_non_exhaustive()
    }
}

impl fmt::Debug for Kept {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Kept").field("values", &self.values).finish_non_exhaustive()
    }
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
