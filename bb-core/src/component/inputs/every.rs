//! All messages of an input since the last dispatch.

use super::slot::Slot;
use crate::declaration::InputDeclaration;
use crate::fault::discard;
use crate::message::{Payload, Stamped};
use crate::pubsub::{Bound, Held, counted_bytes, is_counted};
use std::cell::Cell;
use std::collections::VecDeque;
use std::iter::Chain;
use std::slice::Iter;

#[cfg(test)]
mod tests;

/// All messages of one input of a struct that have arrived since the last run, in order of arrival: none or several.
///
/// No message is in two runs. Their age does not matter: the stamps tell it, and a tolerance leaves out none of them. The estimator can
/// run without such an input. A robot that declares it as required has a run dropped if the latest message is missing or older than the
/// tolerance, as for any other input, and the messages wait for the next run. Across moving joints, the transform of the input is that at
/// the time of its last message.
///
/// While the driver is silent, up to [`MOST`](Self::MOST) messages wait for it, and no more than
/// [`Overflow::DEFAULT_BYTES`](crate::Overflow::DEFAULT_BYTES). Further ones displace the oldest, which is counted as
/// [`DropReason::Displaced`](crate::run::DropReason::Displaced), and [`lost`](Self::lost) tells how many. Messages that wait when the
/// estimator is restarted are lost with its state. Messages that a full inbox drops do not arrive here; they are counted there.
#[derive(Debug)]
pub struct Every<'a, T> {
    first: &'a [Stamped<T>],
    second: &'a [Stamped<T>],
    lost: u64,
}

impl<T> Clone for Every<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Every<'_, T> {}

impl<T> Default for Every<'_, T> {
    fn default() -> Self {
        Self::new(&[])
    }
}

impl<'a, T> Every<'a, T> {
    /// The largest number of messages that wait for the driver, the same as in an inbox.
    pub const MOST: usize = 1024;

    /// Messages that have arrived since the last run.
    pub fn new(messages: &'a [Stamped<T>]) -> Self {
        Self { first: messages, second: &[], lost: 0 }
    }

    /// A single message.
    pub fn one(message: &'a Stamped<T>) -> Self {
        Self::new(std::slice::from_ref(message))
    }

    /// The messages, the oldest first.
    pub fn iter(&self) -> Chain<Iter<'a, Stamped<T>>, Iter<'a, Stamped<T>>> {
        self.first.iter().chain(self.second)
    }

    /// The newest message.
    pub fn last(&self) -> Option<&'a Stamped<T>> {
        self.second.last().or(self.first.last())
    }

    /// The number of messages.
    pub fn len(&self) -> usize {
        self.first.len() + self.second.len()
    }

    /// Returns whether no message has arrived since the last run.
    pub fn is_empty(&self) -> bool {
        self.first.is_empty() && self.second.is_empty()
    }

    /// Returns the same messages, after others were lost.
    pub fn after_losing(self, lost: u64) -> Self {
        Self { lost, ..self }
    }

    /// The number of messages since the last run that were displaced by newer ones, and are not among these.
    pub fn lost(&self) -> u64 {
        self.lost
    }
}

impl<'a, T> IntoIterator for Every<'a, T> {
    type Item = &'a Stamped<T>;
    type IntoIter = Chain<Iter<'a, Stamped<T>>, Iter<'a, Stamped<T>>>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

/// The messages of one input since the last dispatch.
#[doc(hidden)]
#[derive(Debug)]
pub struct EverySlot<T> {
    /// Messages since the last dispatch; those that have been seen come first, until another arrives.
    messages: VecDeque<Stamped<T>>,
    /// The counted bytes of each, for a payload of which they count.
    sizes: VecDeque<usize>,
    held: Held,
    seen: Cell<usize>,
    lost: Cell<u64>,
    declaration: Option<&'static InputDeclaration>,
}

impl<T> Default for EverySlot<T> {
    fn default() -> Self {
        Self {
            messages: VecDeque::new(),
            sizes: VecDeque::new(),
            held: Held::default(),
            seen: Cell::new(0),
            lost: Cell::new(0),
            declaration: None,
        }
    }
}

impl<T: Payload> Slot<T> for EverySlot<T> {
    fn declare(&mut self, declaration: &'static InputDeclaration) {
        self.declaration = Some(declaration);
    }

    fn store(&mut self, message: &Stamped<T>) -> u64 {
        let bound = const { Bound::of_estimator(Every::<T>::MOST) };
        let bytes = counted_bytes(message);
        self.drop_first(self.seen.get());
        self.seen.set(0);
        let mut displaced = 0;
        while !bound.has_room(self.held, bytes) {
            self.drop_first(1);
            displaced += 1;
        }
        self.lost.set(self.lost.get() + displaced);
        self.messages.push_back(message.clone());
        self.held.add(bytes);
        if const { is_counted::<T>() } {
            self.sizes.push_back(bytes);
        }
        displaced
    }

    fn latest(&self) -> (Option<&'static InputDeclaration>, Option<&Stamped<T>>) {
        (self.declaration, self.messages.back())
    }
}

impl<T> EverySlot<T> {
    /// Drops messages one by one: a second `Drop` that panics while the first one unwinds would abort the process.
    fn drop_first(&mut self, count: usize) {
        for message in (0..count).map_while(|_| self.messages.pop_front()) {
            self.held.remove(self.sizes.pop_front().unwrap_or(0));
            discard(message);
        }
    }
}

impl<T> Drop for EverySlot<T> {
    fn drop(&mut self) {
        self.drop_first(self.messages.len());
    }
}

impl<T: Payload> EverySlot<T> {
    /// Returns the messages that no dispatch has seen, and marks them as seen.
    pub fn take(&self) -> Every<'_, T> {
        let seen = self.seen.replace(self.messages.len());
        let (first, second) = self.messages.as_slices();
        let (in_first, in_second) = (seen.min(first.len()), seen.saturating_sub(first.len()));
        Every {
            first: first.get(in_first..).unwrap_or_default(),
            second: second.get(in_second..).unwrap_or_default(),
            lost: self.lost.replace(0),
        }
    }
}
