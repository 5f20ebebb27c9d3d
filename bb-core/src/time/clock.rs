//! The clock: real, or virtual and moved by whoever runs the robot.

use super::{MonotonicTime, WallTime};
use std::sync::atomic::{AtomicI64, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// The one source of time of a robot. Clones read the same clock.
///
/// *Real* time starts at zero when the process first reads it and never goes back. *Virtual* time stands still until
/// it is set, so that a recorded or simulated run replays with the same stamps, as fast as the machine can.
#[derive(Clone, Debug)]
pub struct Clock {
    kind: Kind,
    /// Wall time minus monotonic time, in nanoseconds.
    wall_offset_nanos: i64,
}

#[derive(Clone, Debug)]
enum Kind {
    Real(Instant),
    Virtual(Arc<AtomicI64>),
}

impl Clock {
    /// The machine's clock. All real clocks of a process share one zero.
    pub fn real() -> Self {
        static PROCESS: OnceLock<(Instant, i64)> = OnceLock::new();
        let (zero, wall_offset_nanos) = *PROCESS.get_or_init(|| {
            let unix = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
            (Instant::now(), super::instant::nanos_of(unix))
        });
        Self { kind: Kind::Real(zero), wall_offset_nanos }
    }

    /// A virtual clock that stands at `start`, with the Unix epoch at its zero.
    pub fn virtual_at(start: MonotonicTime) -> Self {
        Self { kind: Kind::Virtual(Arc::new(AtomicI64::new(start.as_nanos()))), wall_offset_nanos: 0 }
    }

    /// The time now.
    pub fn now(&self) -> MonotonicTime {
        match &self.kind {
            Kind::Real(zero) => MonotonicTime::ZERO + zero.elapsed(),
            Kind::Virtual(nanos) => MonotonicTime::from_nanos(nanos.load(Ordering::Acquire)),
        }
    }

    /// The calendar time that belongs to `time`.
    pub fn wall_at(&self, time: MonotonicTime) -> WallTime {
        WallTime::from_unix_nanos(time.as_nanos().saturating_add(self.wall_offset_nanos))
    }

    /// Whether time is virtual.
    pub fn is_virtual(&self) -> bool {
        matches!(self.kind, Kind::Virtual(_))
    }

    /// Moves a virtual clock on to `time`; never back, and never a real one.
    pub(crate) fn advance_to(&self, time: MonotonicTime) {
        if let Kind::Virtual(nanos) = &self.kind {
            nanos.fetch_max(time.as_nanos(), Ordering::AcqRel);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn real_time_does_not_go_back_and_is_shared() {
        let (a, b) = (Clock::real(), Clock::real());
        let first = a.now();
        assert!(b.now() >= first);
        assert!(a.wall_at(first).as_unix_nanos() > 1_600_000_000_000_000_000);
    }

    #[test]
    fn virtual_time_moves_only_forward_and_only_when_told() {
        let clock = Clock::virtual_at(MonotonicTime::from_nanos(5));
        let reader = clock.clone();
        clock.advance_to(MonotonicTime::from_nanos(9));
        clock.advance_to(MonotonicTime::from_nanos(7));
        assert_eq!(reader.now(), MonotonicTime::from_nanos(9));
    }
}
