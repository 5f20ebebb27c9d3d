//! The latest message of an input.

use super::slot::{Slot, SyncMiss};
use crate::declaration::InputDeclaration;
use crate::message::{Payload, Stamped};
use crate::time::MonotonicTime;
use std::cell::Cell;
use std::ops::Deref;

/// One input of a struct: its message, and whether it is new since the last dispatch.
#[derive(Debug)]
pub struct Input<'a, T> {
    message: &'a Stamped<T>,
    is_new: bool,
}

impl<T> Clone for Input<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Input<'_, T> {}

impl<'a, T> Input<'a, T> {
    /// A message that has arrived since the last dispatch.
    pub fn new(message: &'a Stamped<T>) -> Self {
        Self { message, is_new: true }
    }

    /// A message that an earlier dispatch has seen already.
    pub fn seen(message: &'a Stamped<T>) -> Self {
        Self { message, is_new: false }
    }

    /// Returns whether the message has arrived since the last dispatch, so that each reading of a slow sensor is fused once.
    pub fn is_new(&self) -> bool {
        self.is_new
    }

    /// The message.
    pub fn message(&self) -> &'a Stamped<T> {
        self.message
    }
}

impl<T> Deref for Input<'_, T> {
    type Target = Stamped<T>;
    fn deref(&self) -> &Stamped<T> {
        self.message
    }
}

/// The latest message of one input, and how old it may be.
#[doc(hidden)]
#[derive(Debug)]
pub struct LatestSlot<T> {
    message: Option<Stamped<T>>,
    is_new: Cell<bool>,
    declaration: Option<&'static InputDeclaration>,
}

impl<T> Default for LatestSlot<T> {
    fn default() -> Self {
        Self { message: None, is_new: Cell::new(false), declaration: None }
    }
}

impl<T: Payload> Slot<T> for LatestSlot<T> {
    fn declare(&mut self, declaration: &'static InputDeclaration) {
        self.declaration = Some(declaration);
    }

    #[inline]
    fn store(&mut self, message: &Stamped<T>) -> u64 {
        self.message = Some(message.clone());
        self.is_new.set(true);
        0
    }

    fn latest(&self) -> (Option<&'static InputDeclaration>, Option<&Stamped<T>>) {
        (self.declaration, self.message.as_ref())
    }
}

impl<T: Payload> LatestSlot<T> {
    /// Returns the message if it has arrived and is not too old for a driver of `time`, and marks it as seen.
    pub fn take(&self, time: MonotonicTime) -> Option<Input<'_, T>> {
        let message = self.message.as_ref()?;
        let is_too_old = self.declaration?.is_too_old(time.nanos_since(message.monotonic_time));
        (!is_too_old).then(|| Input { message, is_new: self.is_new.replace(false) })
    }

    /// The message of a required input; the error is that of [`Slot::miss`].
    pub fn require(&self, time: MonotonicTime) -> Result<Input<'_, T>, SyncMiss> {
        let input = self.declaration.map_or(usize::MAX, |declaration| declaration.index);
        self.take(time).ok_or(SyncMiss { input, age_nanos: None })
    }
}
