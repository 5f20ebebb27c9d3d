//! Values that a robot owns until its last handle is dropped: options, telemetry handlers, state kept by estimators.
//! Their `Drop` is user code, and may block.

use crate::fault::discard;
use crate::node::Mode;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// How long the thread that drops the last handle waits.
const DROPPED_WITHIN: Duration = Duration::from_millis(200);

/// Drops a value once this is dropped. A panic in its `Drop` is logged.
pub(super) enum Remains {
    /// On virtual time all user code runs on the caller's thread.
    Here(Option<Box<dyn Send + Sync>>),
    /// On a thread of its own, which is waited for, but not forever.
    Apart {
        begin: Option<Sender<()>>,
        /// An uncontended lock, since a receiver alone cannot be shared.
        dropped: Mutex<Receiver<()>>,
    },
}

impl Remains {
    /// `value` is dropped no later than here if there is no thread to be had.
    pub(super) fn of(mode: Mode, value: impl Send + Sync + 'static) -> Option<Self> {
        if mode != Mode::Real {
            return Some(Self::Here(Some(Box::new(value))));
        }
        let (begin, begun) = channel();
        let (done, dropped) = channel::<()>();
        let drop_it = move || {
            // It ends when the other end is dropped.
            let _ = begun.recv();
            discard(value);
            drop(done);
        };
        std::thread::Builder::new().name("drop".into()).spawn(drop_it).ok()?;
        Some(Self::Apart { begin: Some(begin), dropped: Mutex::new(dropped) })
    }
}

impl Drop for Remains {
    fn drop(&mut self) {
        let (begin, dropped) = match self {
            Self::Here(value) => return discard(value.take()),
            Self::Apart { begin, dropped } => (begin, dropped),
        };
        *begin = None;
        let dropped = dropped.get_mut().unwrap_or_else(PoisonError::into_inner);
        // Nothing is sent: the other end is dropped.
        if dropped.recv_timeout(DROPPED_WITHIN) == Err(RecvTimeoutError::Timeout) {
            tracing::warn!("what the robot owned was not dropped in time");
        }
    }
}
