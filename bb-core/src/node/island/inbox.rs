//! What waits for an island that somebody holds.

use crate::time::MonotonicTime;
use std::collections::VecDeque;

/// Messages, and that something may be due, in the order in which they came.
pub(super) struct Inbox<M> {
    messages: VecDeque<(MonotonicTime, M)>,
    /// The first wake keeps its place, however many messages and wakes follow; of those that follow one is kept, behind
    /// all messages. So a flood does not hold up what is due, nor does what is due overtake a message that came before.
    wakes: [Option<Wake>; 2],
}

/// Something may be due since `time`.
#[derive(Clone, Copy)]
struct Wake {
    time: MonotonicTime,
    /// Messages that came before.
    behind: usize,
}

/// What is taken from an inbox.
pub(super) enum Taken<M> {
    Message(MonotonicTime, M),
    Wake(MonotonicTime),
}

/// What an inbox holds, as one word: four times the messages, and the wakes.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct Pending(pub(super) usize);

impl Pending {
    pub(super) const NOTHING: Self = Self(0);

    pub(super) fn has_room(self, capacity: usize) -> bool {
        self.0 / 4 < capacity
    }
}

impl<M> Inbox<M> {
    pub(super) fn new() -> Self {
        Self { messages: VecDeque::new(), wakes: [None; 2] }
    }

    /// Makes room for as many messages as it may hold.
    pub(super) fn reserve(&mut self, capacity: usize) {
        if self.messages.capacity() == 0 {
            self.messages.reserve_exact(capacity);
        }
    }

    pub(super) fn pending(&self) -> Pending {
        Pending(4 * self.messages.len() + self.wakes.iter().flatten().count())
    }

    pub(super) fn has_room(&self, capacity: usize) -> bool {
        self.messages.len() < capacity
    }

    pub(super) fn push(&mut self, now: MonotonicTime, message: M) {
        self.messages.push_back((now, message));
    }

    /// Takes the oldest message, which makes room for another.
    pub(super) fn pop(&mut self) -> Option<M> {
        self.next().map(|(_, message)| message)
    }

    pub(super) fn wake(&mut self, now: MonotonicTime) {
        let wake = Some(Wake { time: now, behind: self.messages.len() });
        match &mut self.wakes {
            [first @ None, _] => *first = wake,
            [Some(_), second] => *second = wake,
        }
    }

    /// Takes the first message of which `is_wanted` holds.
    pub(super) fn take_first(&mut self, is_wanted: impl Fn(&M) -> bool) -> Option<M> {
        let position = self.messages.iter().position(|(_, message)| is_wanted(message))?;
        self.messages.remove(position).map(|(_, message)| message)
    }

    pub(super) fn take(&mut self) -> Option<Taken<M>> {
        if let [Some(Wake { time, behind: 0 }), second] = self.wakes {
            self.wakes = [second, None];
            return Some(Taken::Wake(time));
        }
        self.next().map(|(now, message)| Taken::Message(now, message))
    }

    fn next(&mut self) -> Option<(MonotonicTime, M)> {
        let next = self.messages.pop_front()?;
        for wake in self.wakes.iter_mut().flatten() {
            wake.behind = wake.behind.saturating_sub(1);
        }
        Some(next)
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    fn at(nanos: i64) -> MonotonicTime {
        MonotonicTime::from_nanos(nanos)
    }

    fn taken(inbox: &mut Inbox<char>) -> String {
        let text = |taken: Taken<char>| match taken {
            Taken::Message(_, message) => message.to_string(),
            Taken::Wake(time) => time.as_nanos().to_string(),
        };
        std::iter::from_fn(|| inbox.take()).map(text).collect()
    }

    #[test]
    fn what_is_due_keeps_its_place_among_the_messages() {
        let mut inbox = Inbox::new();
        inbox.push(at(0), 'a');
        inbox.wake(at(1));
        inbox.push(at(2), 'b');
        inbox.wake(at(3));
        inbox.push(at(4), 'c');
        inbox.wake(at(5));
        inbox.push(at(6), 'd');
        assert_eq!(inbox.pop(), Some('a'), "one is dropped to make room");
        assert_eq!(taken(&mut inbox), "1bc5d", "of those behind the first the last is kept");
        assert!(inbox.pending() == Pending::NOTHING);
    }

    #[test]
    fn a_flood_of_messages_and_wakes_does_not_hold_up_what_is_due() {
        let mut inbox = Inbox::new();
        let mut woken = 0;
        for round in 0..1000 {
            inbox.push(at(round), 'x');
            inbox.push(at(round), 'x');
            inbox.wake(at(round));
            woken += usize::from(matches!(inbox.take(), Some(Taken::Wake(_))));
        }
        assert!(woken > 5, "it was woken {woken} times");
    }
}
