//! Durations of the callbacks of a turn.

use super::environment::{Environment, Mode};
use crate::time::MonotonicTime;
use bb_message::__private::{Reading, Stopwatch};
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
    reading: Reading,
}

/// Beginning of a callback to be measured.
#[derive(Clone, Copy, Debug)]
pub(super) struct Begun(Reading);

/// End and duration of a measured callback.
pub(super) struct Measured {
    pub(super) end: MonotonicTime,
    pub(super) nanos: i64,
}

impl Timing {
    /// Begins a callback that is measured: when another one ended, if that was right before.
    pub(super) fn begin(&self, environment: &Environment) -> Begun {
        if let Some(ended) = self.ended.take() {
            return ended;
        }
        let clock = environment.clock();
        if let Some(first) = self.first.get() {
            return Begun(first.stopwatch.read(clock));
        }
        let stopwatch = Stopwatch::start();
        let first = First { time: clock.now(), stopwatch, reading: stopwatch.read(clock) };
        self.first.set(Some(first));
        Begun(first.reading)
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
                let ended = first.stopwatch.read(clock);
                self.ended.set(Some(Begun(ended)));
                let nanos = first.stopwatch.nanos_between(begun, ended);
                Measured { end: first.time.plus_nanos(first.stopwatch.nanos_between(first.reading, ended)), nanos }
            }
            _ => {
                let nanos = virtual_nanos();
                Measured { end: clock.now().plus_nanos(nanos), nanos }
            }
        }
    }
}
