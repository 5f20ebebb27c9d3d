//! Stores of an input's messages between two dispatches.

use crate::declaration::InputDeclaration;
use crate::message::Payload;
use crate::message::Stamped;
use crate::time::MonotonicTime;

/// Keeps messages of one input until the driver arrives.
#[doc(hidden)]
pub trait Slot<T: Payload> {
    /// Sets the declared input that fills it.
    fn declare(&mut self, declaration: &'static InputDeclaration);

    /// Keeps a copy of `message`; returns how many that no dispatch has seen were dropped to make room.
    fn store(&mut self, message: &Stamped<T>) -> u64;

    /// The declared input, and its latest message.
    fn latest(&self) -> (Option<&'static InputDeclaration>, Option<&Stamped<T>>);

    /// The miss of a required input that has not arrived, or is too old for a driver of `time`; `None` if there is no
    /// miss.
    fn miss(&self, time: MonotonicTime) -> Option<SyncMiss> {
        let (declaration, message) = self.latest();
        let declaration = declaration.filter(|declaration| !declaration.optional)?;
        let Some(message) = message else {
            return Some(SyncMiss { input: declaration.index, age_nanos: None });
        };
        let age_nanos = time.nanos_since(message.monotonic_time);
        declaration
            .is_too_old(age_nanos)
            .then_some(SyncMiss { input: declaration.index, age_nanos: Some(age_nanos) })
    }
}

/// The input because of which a dispatch was dropped.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SyncMiss {
    /// Number among the declared inputs.
    pub input: usize,
    /// Age of the message relative to the driver's, in nanoseconds; `None` if it has not arrived yet.
    pub age_nanos: Option<i64>,
}
