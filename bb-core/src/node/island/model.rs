//! Every order in which threads can meet at an island, by a model checker: `RUSTFLAGS="--cfg loom"`.
//!
//! In each, every message is delivered or counted as dropped, the order of each publisher is kept, and nothing stays in
//! the inbox: nobody misses to be told. That one thread at a time is inside is the lock's own type. (The checker's locks order
//! more than real ones do: what the fences are for, they say where they stand.)

use super::{Island, IslandDeclaration, Key, Sea, Shore};
use crate::journal::Journal;
use crate::time::MonotonicTime;
use loom::sync::Arc;
use loom::sync::atomic::{AtomicUsize, Ordering};
use loom::thread;

/// What was delivered. Its inbox holds `CAPACITY` messages.
#[derive(Default)]
struct Seen<const CAPACITY: usize> {
    /// The last number of each publisher.
    last: [usize; 2],
    messages: usize,
    wakes: usize,
}

/// A publisher, and the number of its message, from 1.
type Message = (usize, usize);

const NOW: MonotonicTime = MonotonicTime::ZERO;

impl<const CAPACITY: usize> Seen<CAPACITY> {
    fn see(&mut self, (publisher, number): Message) {
        assert!(self.last[publisher] < number, "out of order");
        self.last[publisher] = number;
        self.messages += 1;
    }
}

impl Sea for AtomicUsize {
    fn journal(&self) -> Option<&Journal> {
        None
    }
}

impl<const CAPACITY: usize> Shore for Seen<CAPACITY> {
    /// Counts what was dropped.
    type Wiring = AtomicUsize;
    type Message = Message;
    const CAPACITY: usize = CAPACITY;
    const DECLARATION: IslandDeclaration = IslandDeclaration { number: 0, name: "model", worker: None };

    fn deliver(&mut self, _: &AtomicUsize, message: &Message, _: MonotonicTime) {
        self.see(*message);
    }

    fn wake(&mut self, _: &AtomicUsize, _: MonotonicTime) {
        self.wakes += 1;
    }

    fn dropped(dropped: &AtomicUsize, _: &Message) {
        dropped.fetch_add(1, Ordering::Relaxed);
    }

    fn terminate(&mut self) {}
}

const KEY: Key = Key { entry: 0, line: 0 };

/// What a thread does.
type Thread<const CAPACITY: usize> = fn(&Island<Seen<CAPACITY>>, &AtomicUsize);

fn publish<const CAPACITY: usize>(island: &Island<Seen<CAPACITY>>, dropped: &AtomicUsize, message: Message) {
    island.enter(dropped, NOW, KEY, |seen| seen.see(message), || message);
}

fn publish_twice<const PUBLISHER: usize, const CAPACITY: usize>(
    island: &Island<Seen<CAPACITY>>,
    dropped: &AtomicUsize,
) {
    publish(island, dropped, (PUBLISHER, 1));
    publish(island, dropped, (PUBLISHER, 2));
}

/// Runs two threads in all orders, of those with three preemptions at most.
fn check<const CAPACITY: usize>(threads: [Thread<CAPACITY>; 2], messages: usize, is_woken: bool) {
    let mut checker = loom::model::Builder::new();
    checker.preemption_bound = Some(3);
    checker.check(move || {
        let shared = Arc::new((Island::new(Seen::<CAPACITY>::default()), AtomicUsize::new(0)));
        let [first, second] = threads;
        let beside = Arc::clone(&shared);
        let spawned = thread::spawn(move || second(&beside.0, &beside.1));
        first(&shared.0, &shared.1);
        spawned.join().expect("it does not panic");
        let (island, dropped) = &*shared;
        assert_eq!(island.pending.load(Ordering::Relaxed), 0, "somebody was not told");
        let seen = island.state.lock().expect("nobody panicked");
        assert_eq!(seen.messages + dropped.load(Ordering::Relaxed), messages, "something was lost uncounted");
        assert_eq!(seen.wakes > 0, is_woken);
    });
}

#[test]
fn two_publishers() {
    check::<4>([publish_twice::<0, 4>, publish_twice::<1, 4>], 4, false);
}

#[test]
fn two_publishers_and_an_inbox_that_is_full() {
    check::<1>([publish_twice::<0, 1>, publish_twice::<1, 1>], 4, false);
}

#[test]
fn a_publisher_and_what_is_due() {
    let due: Thread<4> = |island, dropped| (0..2).for_each(|_| island.wake_up(dropped, NOW));
    check([publish_twice::<0, 4>, due], 2, true);
}

#[test]
fn a_publisher_and_a_caller() {
    let calls: Thread<1> = |island, dropped| {
        assert!(island.with(dropped, None, |_| ()).is_some());
        publish(island, dropped, (1, 1));
    };
    check([publish_twice::<0, 1>, calls], 3, false);
}
