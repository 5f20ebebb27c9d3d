//! Processing one entry of an island: its line in the journal, its turn, and what the turn has found.

use super::inbox::{Dequeued, Entry};
use super::{Island, IslandState, IslandWiring as _, Key, Keyed, RELAXED};
use crate::fault::discard;
use crate::journal::Event;
use crate::node::{NodeEntry, Turn};
use crate::time::MonotonicTime;
use std::sync::atomic::Ordering;

impl<S: IslandState> Island<S> {
    /// Processes one entry: writes its line, runs it, and records how long measured callbacks took.
    #[inline]
    pub(super) fn process<T>(
        &self,
        wiring: &S::Wiring,
        now: MonotonicTime,
        line: impl FnOnce() -> Event,
        run: impl FnOnce(&Turn<'_>) -> T,
    ) -> T {
        let environment = wiring.environment();
        let Some(journal) = environment.journal() else { return self.process_line(wiring, now, None, run) };
        let wall_offset_nanos = environment.clock().wall_offset_nanos();
        let line = journal.write(now, wall_offset_nanos, line());
        self.process_line(wiring, now, Some((line, wall_offset_nanos)), run)
    }

    /// Processes an entry whose line has already been written with that offset of the wall clock.
    #[inline]
    pub(super) fn process_line<T>(
        &self,
        wiring: &S::Wiring,
        now: MonotonicTime,
        line: Option<(u64, i64)>,
        run: impl FnOnce(&Turn<'_>) -> T,
    ) -> T {
        let environment = wiring.environment();
        let wall_offset_nanos = match line {
            Some((_, offset)) => offset,
            None => environment.clock().wall_offset_nanos(),
        };
        let turn = Turn::new(environment, S::DECLARATION.number, now, wall_offset_nanos, &self.running);
        // Only one thread writes at a time, so plain stores suffice instead of atomic additions. They are for the report of a turn
        // that hangs.
        self.entered_nanos.store(now.as_nanos(), RELAXED);
        self.turns.store(self.turns.load(RELAXED).wrapping_add(1), RELAXED);
        let result = run(&turn);
        if let Some((cause, _)) = line {
            turn.write_found(cause, &S::DECLARATION);
        }
        result
    }

    /// Takes the next entry and processes it; returns `false` if the inbox is empty.
    pub(super) fn process_next(&self, state: &mut S, wiring: &S::Wiring) -> bool {
        let environment = wiring.environment();
        let mut inbox = self.inbox();
        let Some(dequeued) = inbox.take() else { return false };
        self.pending.store(inbox.pending().0, Ordering::Relaxed);
        self.hangs.store(false, Ordering::Relaxed);
        // The inbox's lock is held here, so the line of a message dropped at the same time comes after this one.
        let (now, line) = match &dequeued {
            Dequeued::Retire(now) => (*now, Event::Retire { island: S::DECLARATION.number }),
            Dequeued::Entry(now, entry) => (*now, line_of::<S>(entry)),
        };
        let line = environment.journal().map(|journal| {
            let offset = environment.clock().wall_offset_nanos();
            (journal.write(now, offset, line), offset)
        });
        drop(inbox);
        self.tell_waiting();
        let retires = matches!(dequeued, Dequeued::Retire(_));
        self.process_line(wiring, now, line, |turn| match dequeued {
            Dequeued::Retire(_) => for_all(state, wiring, turn, || NodeEntry::Retire),
            Dequeued::Entry(_, Entry::Message(Keyed { message, .. }, _)) => {
                state.deliver(wiring, &message, turn);
                // Its publisher is done with it, and those who got it are too: a panic in its `Drop` is nobody's.
                discard(message);
            }
            Dequeued::Entry(_, Entry::Wake) => state.wake(wiring, turn),
            Dequeued::Entry(_, Entry::Start) => for_all(state, wiring, turn, || NodeEntry::Start),
            Dequeued::Entry(_, Entry::Node(estimator, entry)) => state.handle(wiring, estimator, entry, turn),
        });
        if retires {
            // Count and journal the remaining entries before the last report.
            let mut processed = 0;
            while processed < S::CAPACITY && self.process_next(state, wiring) {
                processed += 1;
            }
            self.has_retired.store(true, Ordering::SeqCst);
            environment.note_retired();
        }
        true
    }
}

pub(super) fn deliver<S: IslandState>(key: Key) -> Event {
    Event::Deliver { island: S::DECLARATION.number, entry: key.entry, message: key.line }
}

pub(super) fn dropped<S: IslandState>(key: Key) -> Event {
    Event::Drop { island: S::DECLARATION.number, entry: key.entry, message: key.line }
}

fn line_of<S: IslandState>(entry: &Entry<Keyed<S::Message>>) -> Event {
    match entry {
        Entry::Message(Keyed { key, .. }, _) => deliver::<S>(*key),
        Entry::Wake => Event::Wake { island: S::DECLARATION.number },
        Entry::Start => Event::Start { island: S::DECLARATION.number },
        Entry::Node(estimator, entry) => entry.line(*estimator, S::DECLARATION.number),
    }
}

pub(super) fn for_all<S: IslandState>(
    state: &mut S,
    wiring: &S::Wiring,
    turn: &Turn<'_>,
    entry: impl Fn() -> NodeEntry,
) {
    for estimator in S::DECLARATION.estimators {
        state.handle(wiring, *estimator, entry(), turn);
    }
}
