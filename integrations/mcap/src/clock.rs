//! The clocks of a recording: the offsets common to its times.

use bb_core::WallTime;
use bb_core::message::Stamp;
use bb_core::time::MonotonicTime;
use std::collections::BTreeMap;

/// The name of the metadata with the recording's [`Clock`].
pub(crate) const CLOCK: &str = "bb.clock";
const OFFSET: &str = "wall_minus_monotonic_ns";
const SHIFT: &str = "date_shift_ns";

/// A virtual clock starts within this time after 1970, when no robots ran: 1 year.
const VIRTUAL_NS: i64 = 365 * DAY_NS;
const DAY_NS: i64 = 86_400_000_000_000;

/// The offsets common to the times of a recording, written once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Clock {
    /// Wall time minus monotonic time, as published, at the first message.
    wall_minus_monotonic_ns: i64,
    /// The offset added to all wall times: a run on virtual time from zero is given today's date, since viewers show
    /// dates, and tools sort by them.
    shift_ns: i64,
}

impl Clock {
    /// Of a recording that begins with a message of this stamp, `today`.
    pub(crate) fn of(first: &Stamp, today: WallTime) -> Self {
        let wall = first.wall_time.as_unix_nanos();
        let is_virtual = (0..VIRTUAL_NS).contains(&wall);
        let midnight = today.as_unix_nanos().div_euclid(DAY_NS).saturating_mul(DAY_NS);
        Self {
            wall_minus_monotonic_ns: wall.wrapping_sub(first.monotonic_time.as_nanos()),
            shift_ns: if is_virtual { midnight } else { 0 },
        }
    }

    /// The wall time as recorded.
    // Wrapping, so that every time is read back.
    pub(crate) fn recorded(&self, time: WallTime) -> WallTime {
        WallTime::from_unix_nanos(time.as_unix_nanos().wrapping_add(self.shift_ns))
    }

    /// The wall time as published.
    pub(crate) fn published(&self, time: WallTime) -> WallTime {
        WallTime::from_unix_nanos(time.as_unix_nanos().wrapping_sub(self.shift_ns))
    }

    /// The monotonic time at a published wall time.
    pub(crate) fn monotonic(&self, wall_time: WallTime) -> MonotonicTime {
        MonotonicTime::from_nanos(wall_time.as_unix_nanos().wrapping_sub(self.wall_minus_monotonic_ns))
    }

    pub(crate) fn to_metadata(self) -> BTreeMap<String, String> {
        [(OFFSET, self.wall_minus_monotonic_ns), (SHIFT, self.shift_ns)]
            .map(|(key, value)| (key.to_owned(), value.to_string()))
            .into()
    }

    pub(crate) fn from_metadata(metadata: &BTreeMap<String, String>) -> Option<Self> {
        Some(Self {
            wall_minus_monotonic_ns: metadata.get(OFFSET)?.parse().ok()?,
            shift_ns: metadata.get(SHIFT)?.parse().ok()?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_time_is_read_back() {
        let today = WallTime::from_unix_nanos(1_800_000_000_123_456_789);
        for (monotonic, wall) in [(0, 0), (7, 1_700_000_000_000_000_000), (i64::MIN, i64::MAX), (5, -5)] {
            let (monotonic_time, wall_time) =
                (MonotonicTime::from_nanos(monotonic), WallTime::from_unix_nanos(wall));
            let clock = Clock::of(&Stamp { monotonic_time, wall_time, ..Stamp::default() }, today);
            assert_eq!(clock.published(clock.recorded(wall_time)), wall_time);
            assert_eq!(clock.monotonic(wall_time), monotonic_time);
            assert_eq!(Clock::from_metadata(&clock.to_metadata()), Some(clock));
            let is_dated = clock.recorded(wall_time) != wall_time;
            assert_eq!(is_dated, wall == 0, "a real date is kept: {wall}");
        }
    }
}
