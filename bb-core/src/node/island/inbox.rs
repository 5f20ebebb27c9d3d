//! The entries that wait for an island held by another thread.

use crate::declaration::ParameterValues;
use crate::node::NodeEntry;
use crate::pubsub::{Bound, Held};
use crate::time::MonotonicTime;
use std::collections::VecDeque;

/// An entry with its time of arrival.
pub(super) type Dated<M> = (MonotonicTime, Entry<M>);

/// An entry that can wait.
pub(super) enum Entry<M> {
    /// A message, and its counted bytes.
    Message(M, usize),
    /// Something is due.
    Wake,
    /// All estimators start.
    Start,
    /// An entry for the estimator with that number.
    Node(usize, NodeEntry),
}

/// Entries in order of arrival.
///
/// Messages are bounded in number and in bytes. All other entries are bounded by their kind. There are at most two wakes. Each
/// estimator has at most one start, one restart, one give-up and one loss. It also has the one-way requests allowed for it and a few
/// changes of options.
pub(super) struct Inbox<M> {
    entries: VecDeque<Dated<M>>,
    bound: Bound,
    held: Held,
    wakes: u8,
    /// Time of the stop, if one is requested: the estimators stop before any other waiting entry is processed.
    retires: Option<MonotonicTime>,
}

/// The number of wakes that may wait. The first keeps its place, so a flood of messages does not delay due work. The second covers
/// work that becomes due meanwhile. For anything later, the island's agenda asks again.
const MOST_WAKES: u8 = 2;

/// Changes of options that may wait for one estimator; the next one replaces the last of them.
const MOST_OPTIONS: usize = 16;

/// The contents of an inbox as one word: messages in the upper part, everything else in the lower part.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Pending(pub(super) usize);

const SHIFT: u32 = usize::BITS / 2;

impl Pending {
    pub(super) const NOTHING: Self = Self(0);
}

impl<M> Inbox<M> {
    pub(super) fn new(capacity: usize) -> Self {
        let bound = Bound::of_estimator(capacity);
        Self { entries: VecDeque::new(), bound, held: Held::default(), wakes: 0, retires: None }
    }

    /// Allocates room in advance.
    pub(super) fn reserve(&mut self) {
        if self.entries.capacity() == 0 {
            self.entries.reserve_exact(self.bound.in_advance::<Dated<M>>());
        }
    }

    pub(super) fn pending(&self) -> Pending {
        let others = self.entries.len() - self.held.messages + usize::from(self.retires.is_some());
        Pending((self.held.messages << SHIFT) | others)
    }

    /// Returns whether a message of that many counted bytes fits.
    pub(super) fn has_room(&self, bytes: usize) -> bool {
        self.bound.has_room(self.held, bytes)
    }

    pub(super) fn push(&mut self, now: MonotonicTime, message: M, bytes: usize) {
        self.held.add(bytes);
        self.entries.push_back((now, Entry::Message(message, bytes)));
    }

    /// Takes the oldest message to make room for another one.
    pub(super) fn pop_message(&mut self) -> Option<M> {
        self.take_message(|_| true)
    }

    /// Takes the first message that matches `is_wanted`.
    pub(super) fn take_message(&mut self, is_wanted: impl Fn(&M) -> bool) -> Option<M> {
        let position = self.entries.iter().position(|(_, entry)| match entry {
            Entry::Message(message, _) => is_wanted(message),
            _ => false,
        })?;
        match self.entries.remove(position) {
            Some((_, Entry::Message(message, bytes))) => {
                self.held.remove(bytes);
                Some(message)
            }
            _ => None,
        }
    }

    pub(super) fn wake(&mut self, now: MonotonicTime) {
        if self.wakes < MOST_WAKES {
            self.wakes += 1;
            self.entries.push_back((now, Entry::Wake));
        }
    }

    pub(super) fn start(&mut self, now: MonotonicTime) {
        self.entries.push_back((now, Entry::Start));
    }

    pub(super) fn retire(&mut self, now: MonotonicTime) {
        self.retires = Some(now);
    }

    /// Returns whether the estimators are to stop.
    pub(super) fn retires(&self) -> bool {
        self.retires.is_some()
    }

    /// Adds an entry for an estimator.
    pub(super) fn post(&mut self, now: MonotonicTime, estimator: usize, entry: NodeEntry) {
        let is_same = |other: &Entry<M>| match (other, &entry) {
            (Entry::Node(number, NodeEntry::Restart), NodeEntry::Restart)
            | (Entry::Node(number, NodeEntry::GiveUp), NodeEntry::GiveUp) => *number == estimator,
            _ => false,
        };
        if self.entries.iter().any(|(_, other)| is_same(other)) {
            return;
        }
        if let NodeEntry::Options(values) = &entry
            && let Some(last) = self.last_of_many_options(estimator)
        {
            *last = values.clone();
            return;
        }
        self.entries.push_back((now, Entry::Node(estimator, entry)));
    }

    fn last_of_many_options(&mut self, estimator: usize) -> Option<&mut ParameterValues> {
        let mut waiting = self.entries.iter_mut().rev().filter_map(|(_, entry)| match entry {
            Entry::Node(number, NodeEntry::Options(values)) if *number == estimator => Some(values),
            _ => None,
        });
        let last = waiting.next()?;
        (waiting.count() + 1 >= MOST_OPTIONS).then_some(last)
    }

    pub(super) fn take(&mut self) -> Option<Dequeued<M>> {
        if let Some(now) = self.retires.take() {
            return Some(Dequeued::Retire(now));
        }
        let (now, entry) = self.entries.pop_front()?;
        match entry {
            Entry::Message(_, bytes) => self.held.remove(bytes),
            Entry::Wake => self.wakes -= 1,
            Entry::Start | Entry::Node(..) => {}
        }
        Some(Dequeued::Entry(now, entry))
    }
}

/// An entry taken from an inbox.
pub(super) enum Dequeued<M> {
    Entry(MonotonicTime, Entry<M>),
    Retire(MonotonicTime),
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    fn at(nanos: i64) -> MonotonicTime {
        MonotonicTime::from_nanos(nanos)
    }

    fn dequeued(inbox: &mut Inbox<char>) -> String {
        let text = |entry: Dequeued<char>| match entry {
            Dequeued::Entry(_, Entry::Message(message, _)) => message.to_string(),
            Dequeued::Entry(time, Entry::Wake) => time.as_nanos().to_string(),
            Dequeued::Entry(_, Entry::Start) => "S".to_owned(),
            Dequeued::Entry(_, Entry::Node(number, entry)) => format!("[{number} {entry:?}]"),
            Dequeued::Retire(_) => "R".to_owned(),
        };
        std::iter::from_fn(|| inbox.take()).map(text).collect()
    }

    #[test]
    fn everything_keeps_its_place_but_the_end() {
        let mut inbox = Inbox::new(2);
        inbox.start(at(0));
        inbox.push(at(0), 'a', 0);
        inbox.wake(at(1));
        inbox.push(at(2), 'b', 0);
        inbox.post(at(2), 7, NodeEntry::Restart);
        inbox.post(at(2), 7, NodeEntry::Restart);
        inbox.wake(at(3));
        inbox.push(at(4), 'c', 0);
        inbox.wake(at(5));
        assert_eq!(inbox.pop_message(), Some('a'), "one is dropped to make room");
        assert!(!inbox.has_room(0));
        inbox.retire(at(6));
        assert_eq!(dequeued(&mut inbox), "RS1b[7 Restart]3c");
        assert!(inbox.pending() == Pending::NOTHING && inbox.has_room(0));
    }

    #[test]
    fn bytes_make_it_full_too_but_one_message_always_fits() {
        const HALF: usize = crate::pubsub::Overflow::DEFAULT_BYTES / 2;
        let mut inbox = Inbox::new(1024);
        assert!(inbox.has_room(3 * HALF), "however large");
        inbox.push(at(0), 'a', HALF);
        inbox.wake(at(0));
        assert!(inbox.has_room(HALF) && !inbox.has_room(HALF + 1));
        inbox.push(at(0), 'b', HALF);
        assert!(inbox.has_room(0) && !inbox.has_room(1));
        assert_eq!(inbox.take_message(|message| *message == 'b'), Some('b'));
        assert!(inbox.has_room(HALF) && !inbox.has_room(HALF + 1));
        assert_eq!(inbox.pop_message(), Some('a'));
        assert_eq!((inbox.held, inbox.has_room(3 * HALF)), (Held::default(), true));
    }

    #[test]
    fn options_that_nobody_takes_do_not_grow_for_ever() {
        let mut inbox = Inbox::<char>::new(1024);
        for _ in 0..1000 {
            inbox.post(at(0), 1, NodeEntry::Options(ParameterValues::new(vec![])));
            inbox.post(at(0), 2, NodeEntry::Options(ParameterValues::new(vec![])));
        }
        assert_eq!(inbox.pending().0, 2 * MOST_OPTIONS);
    }
}
