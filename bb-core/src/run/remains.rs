//! Values that a robot owns until its last handle is dropped: options, telemetry handlers, state kept by estimators.
//! Their `Drop` is user code, and may block.

use crate::fault::discard;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// How long the thread that drops the last handle waits.
const DROPPED_WITHIN: Duration = Duration::from_millis(200);

/// Drops a value on its own thread once this is dropped. Waits for that, but not forever.
#[derive(Debug)]
pub(super) struct Remains {
    begin: Option<Sender<()>>,
    /// An uncontended lock: a receiver alone cannot be shared.
    dropped: Mutex<Receiver<()>>,
}

impl Remains {
    /// If no thread can be started, `value` is dropped here.
    pub(super) fn of(value: impl Send + 'static) -> Option<Self> {
        let (begin, begun) = channel();
        let (done, dropped) = channel::<()>();
        let drop_it = move || {
            // It ends when the other end is dropped.
            let _ = begun.recv();
            discard(value);
            drop(done);
        };
        std::thread::Builder::new().name("drop".into()).spawn(drop_it).ok()?;
        Some(Self { begin: Some(begin), dropped: Mutex::new(dropped) })
    }
}

impl Drop for Remains {
    fn drop(&mut self) {
        self.begin = None;
        let dropped = self.dropped.get_mut().unwrap_or_else(PoisonError::into_inner);
        // Nothing is sent: the other end is dropped.
        if dropped.recv_timeout(DROPPED_WITHIN) == Err(RecvTimeoutError::Timeout) {
            tracing::warn!("what the robot owned was not dropped in time");
        }
    }
}
