//! The clock: real, or virtual and set by the code that runs the robot.

#[cfg(test)]
mod tests;

use super::instant::{MonotonicTime, WallTime, nanos_of};
use std::sync::atomic::{AtomicI64, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// The only source of time of a robot. Clones read the same clock.
///
/// *Real* time starts at zero when the process first reads it and never goes back. *Virtual* time does not move until
/// it is set, so a recorded or simulated run replays with the same stamps, as fast as the machine can.
///
/// A clock created by [`Clock::real`] starts with the machine's date at that moment. A running robot keeps it up to
/// date.
//
// Real time is `std::time::Instant`. Condition variables wait on the same system clock, so a deadline and the wait
// for it cannot drift apart. Crates that read the processor's counter (quanta, minstant, fastant) need 8.5 ns a read
// where `Instant` needs 22, but fail the tests below: without a fence, the counter may be read before an earlier
// load, and a calibration done once drifts. With a fence, and a sequence lock for new calibrations, a read takes 17
// ns. That gain is not worth the `unsafe` that the fence needs. Measuring the duration of a callback is different,
// since it begins and ends on one thread: see `Stopwatch`.
#[derive(Clone, Debug)]
pub struct Clock {
    kind: Kind,
    /// Wall time minus monotonic time, in nanoseconds; shared by the clones.
    wall_offset_nanos: Arc<AtomicI64>,
    /// Start of the run, see [`Clock::start`]; shared by the clones.
    start_nanos: Arc<AtomicI64>,
}

#[derive(Clone, Debug)]
enum Kind {
    Real(Instant),
    Virtual(Arc<AtomicI64>),
}

/// The smallest change of the measured offset that is adopted: more than preemption between two reads causes, less
/// than shows in a recording.
const WALL_STEP_NANOS: u64 = 1_000_000;
/// Latest time, in nanoseconds, of a clock that counts from its start.
const YEAR_NANOS: i64 = 365 * 86_400_000_000_000;

impl Clock {
    /// The machine's clock. All real clocks of a process share one zero.
    pub fn real() -> Self {
        static ZERO: OnceLock<Instant> = OnceLock::new();
        let zero = *ZERO.get_or_init(Instant::now);
        let offset = median_wall_offset(|| read_both(zero));
        let start = nanos_of(zero.elapsed());
        Self {
            kind: Kind::Real(zero),
            wall_offset_nanos: Arc::new(AtomicI64::new(offset)),
            start_nanos: Arc::new(AtomicI64::new(start)),
        }
    }

    /// The date of a virtual clock's zero: 1 January 2001, 00:00 UTC. It is the same for every run, so that a simulation has the same
    /// stamps each time, and viewers of its recording show how long it has run.
    pub const VIRTUAL_ZERO: WallTime = WallTime::from_unix_nanos(978_307_200_000_000_000);

    /// A virtual clock at `start`, with [`VIRTUAL_ZERO`](Self::VIRTUAL_ZERO) at its zero.
    pub fn virtual_at(start: MonotonicTime) -> Self {
        let nanos = || Arc::new(AtomicI64::new(start.as_nanos()));
        let offset = Self::VIRTUAL_ZERO.as_unix_nanos();
        Self {
            kind: Kind::Virtual(nanos()),
            wall_offset_nanos: Arc::new(AtomicI64::new(offset)),
            start_nanos: nanos(),
        }
    }

    /// The current time.
    #[inline]
    pub fn now(&self) -> MonotonicTime {
        match &self.kind {
            Kind::Real(zero) => MonotonicTime::ZERO + zero.elapsed(),
            Kind::Virtual(nanos) => MonotonicTime::from_nanos(nanos.load(Ordering::Acquire)),
        }
    }

    /// The time at which the run begins. On virtual time, components are created at zero, and a run that plays recordings then
    /// begins at the first of their stamps: whatever a component computes over time starts here, not at its `init`. On real time
    /// it is the time at which this clock was created.
    #[inline]
    pub fn start(&self) -> MonotonicTime {
        MonotonicTime::from_nanos(self.start_nanos.load(Ordering::Acquire))
    }

    /// The calendar time at `time`, by the current offset.
    #[inline]
    pub fn wall_at(&self, time: MonotonicTime) -> WallTime {
        WallTime::from_unix_nanos(time.as_nanos().saturating_add(self.wall_offset_nanos()))
    }

    /// The monotonic time at a calendar time, by the current offset: for devices that stamp with the date, such as a
    /// GNSS receiver or a network camera.
    #[inline]
    pub fn monotonic_at(&self, wall: WallTime) -> MonotonicTime {
        MonotonicTime::from_nanos(wall.as_unix_nanos().saturating_sub(self.wall_offset_nanos()))
    }

    /// Wall time minus monotonic time, in nanoseconds. It changes when the machine's date is set.
    #[inline]
    pub fn wall_offset_nanos(&self) -> i64 {
        // The offset guards no other data, so no ordering is needed.
        self.wall_offset_nanos.load(Ordering::Relaxed)
    }

    /// Returns whether time is virtual.
    #[inline]
    pub fn is_virtual(&self) -> bool {
        matches!(self.kind, Kind::Virtual(_))
    }

    /// Measures the offset of a real clock again. Returns the new offset if it differs from the current one by more than 1 ms,
    /// because the machine's date was set. Only one caller gets it.
    // The thread of the timers calls it, at most once a second.
    #[doc(hidden)]
    pub fn refresh_wall(&self) -> Option<i64> {
        match self.kind {
            Kind::Real(zero) => self.follow_wall(median_wall_offset(|| read_both(zero))),
            Kind::Virtual(_) => None,
        }
    }

    /// Sets the offset of a virtual clock; a real one measures its own.
    // A replay calls it, with the offset in the journal.
    #[doc(hidden)]
    pub fn set_wall_offset_nanos(&self, nanos: i64) {
        if self.is_virtual() {
            self.wall_offset_nanos.store(nanos, Ordering::Relaxed);
        }
    }

    /// Sets a virtual clock to `time`, which may be earlier: lines of a journal written by different threads have
    /// times that differ slightly from the order of the lines.
    #[doc(hidden)]
    pub fn set_to(&self, time: MonotonicTime) {
        if let Kind::Virtual(nanos) = &self.kind {
            nanos.store(time.as_nanos(), Ordering::Release);
        }
    }

    /// Advances a virtual clock to `time`. Does nothing if that is earlier, or if the clock is real.
    #[doc(hidden)]
    pub fn advance_to(&self, time: MonotonicTime) {
        if let Kind::Virtual(nanos) = &self.kind {
            nanos.fetch_max(time.as_nanos(), Ordering::AcqRel);
        }
    }

    /// Advances a virtual clock to the beginning of the run, which a recording determines: see `Sensor::starts_at`. Stamps of more
    /// than a year are dates, counted from 1970, as those of bags are.
    #[doc(hidden)]
    pub fn start_at(&self, time: MonotonicTime) {
        self.advance_to(time);
        if self.is_virtual() {
            self.start_nanos.store(self.now().as_nanos(), Ordering::Release);
        }
        if time.as_nanos() > YEAR_NANOS {
            self.set_wall_offset_nanos(0);
        }
    }

    fn follow_wall(&self, measured: i64) -> Option<i64> {
        let current = self.wall_offset_nanos();
        if measured.abs_diff(current) <= WALL_STEP_NANOS {
            return None;
        }
        let order = Ordering::Relaxed;
        self.wall_offset_nanos.compare_exchange(current, measured, order, order).ok()?;
        Some(measured)
    }
}

/// The offset between both clocks, from pairs of reads (monotonic, wall). Preemption between the two
/// reads spoils a pair, which the median leaves out.
fn median_wall_offset(mut read: impl FnMut() -> (i64, i64)) -> i64 {
    let mut offsets = [0; 5].map(|_: i64| {
        let (monotonic, wall) = read();
        wall.saturating_sub(monotonic)
    });
    offsets.sort_unstable();
    offsets[offsets.len() / 2]
}

/// Monotonic and wall time of one moment, in nanoseconds.
fn read_both(zero: Instant) -> (i64, i64) {
    let before = zero.elapsed();
    let wall = SystemTime::now();
    let between = before.saturating_add(zero.elapsed()) / 2;
    (nanos_of(between), unix_nanos(wall))
}

/// Nanoseconds since the Unix epoch, negative before it.
fn unix_nanos(time: SystemTime) -> i64 {
    time.duration_since(UNIX_EPOCH).map_or_else(|before| -nanos_of(before.duration()), nanos_of)
}
