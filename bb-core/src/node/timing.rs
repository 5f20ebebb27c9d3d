//! Durations of the callbacks of a turn.

use super::environment::{Environment, Mode};
use crate::time::MonotonicTime;
use bb_message::__private::Stopwatch;
use std::cell::Cell;

/// The reads of the clock and of the counter in one turn. The clock is read once and the counter once per callback, since the end
/// of a callback is the beginning of the next unless something came between them.
#[derive(Debug, Default)]
pub(super) struct Timing {
    first: Cell<Option<First>>,
    /// End of the last measured callback, as long as nothing has happened since.
    ended: Cell<Option<Begun>>,
}

/// The beginning of the first measured callback of the turn.
#[derive(Clone, Copy, Debug)]
struct First {
    time: MonotonicTime,
    stopwatch: Stopwatch,
}

/// Beginning of a callback to be measured, in nanoseconds since the first of the turn.
#[derive(Clone, Copy, Debug)]
pub(super) struct Begun(i64);

/// End and duration of a measured callback.
pub(super) struct Measured {
    pub(super) end: MonotonicTime,
    pub(super) nanos: i64,
}

impl Timing {
    /// Begins a callback that is measured: when another one ended, if that was right before.
    #[inline]
    pub(super) fn begin(&self, environment: &Environment) -> Begun {
        if let Some(ended) = self.ended.take() {
            return ended;
        }
        let clock = environment.clock();
        if let Some(first) = self.first.get() {
            return Begun(first.stopwatch.nanos(clock));
        }
        self.first.set(Some(First { time: clock.now(), stopwatch: Stopwatch::start(clock) }));
        Begun(0)
    }

    /// Records an event whose time is charged to no callback.
    #[inline]
    pub(super) fn interrupt(&self) {
        self.ended.set(None);
    }

    /// Ends the measurement of a callback. On virtual time the callback took `virtual_nanos`.
    #[inline]
    pub(super) fn end(
        &self,
        Begun(begun): Begun,
        environment: &Environment,
        virtual_nanos: impl FnOnce() -> i64,
    ) -> Measured {
        let clock = environment.clock();
        match self.first.get() {
            Some(first) if environment.mode() == Mode::Real => {
                let ended = first.stopwatch.nanos(clock);
                self.ended.set(Some(Begun(ended)));
                Measured { end: first.time.plus_nanos(ended), nanos: (ended - begun).max(0) }
            }
            _ => {
                let nanos = virtual_nanos();
                Measured { end: clock.now().plus_nanos(nanos), nanos }
            }
        }
    }
}
