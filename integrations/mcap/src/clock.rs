//! The clock of a recording.

use bb_core::WallTime;
use bb_core::message::Stamp;
use bb_core::time::MonotonicTime;
use std::collections::BTreeMap;

/// The name of the metadata with the recording's [`Clock`].
pub(crate) const CLOCK: &str = "bb.clock";
const OFFSET: &str = "wall_minus_monotonic_ns";
const SHIFT: &str = "date_shift_ns";

/// The clock of a recording: the offset between its times, written once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Clock {
    /// Wall time minus monotonic time, as published, at the first message.
    wall_minus_monotonic_ns: i64,
    /// The offset added to all wall times by earlier versions, for which a virtual clock began in 1970.
    shift_ns: i64,
}

impl Clock {
    /// Clock of a recording that begins with a message of this stamp.
    // Wrapping, here and below, so that every time is read back.
    pub(crate) fn of(first: &Stamp) -> Self {
        let wall = first.wall_time.as_unix_nanos();
        Self { wall_minus_monotonic_ns: wall.wrapping_sub(first.monotonic_time.as_nanos()), shift_ns: 0 }
    }

    /// The log time of a message, by its monotonic time: the times of a recording are those of one clock, also if the machine's date
    /// was set in between.
    pub(crate) fn logged(&self, stamp: &Stamp) -> WallTime {
        let monotonic = stamp.monotonic_time.as_nanos();
        WallTime::from_unix_nanos(monotonic.wrapping_add(self.wall_minus_monotonic_ns))
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
        [(OFFSET.to_owned(), self.wall_minus_monotonic_ns.to_string())].into()
    }

    pub(crate) fn from_metadata(metadata: &BTreeMap<String, String>) -> Option<Self> {
        let shift_ns = metadata.get(SHIFT).map(|shift| shift.parse().ok());
        Some(Self {
            wall_minus_monotonic_ns: metadata.get(OFFSET)?.parse().ok()?,
            shift_ns: shift_ns.unwrap_or(Some(0))?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMES: [(i64, i64); 5] =
        [(0, 0), (7, 1_700_000_000_000_000_000), (i64::MIN, i64::MAX), (5, -5), (i64::MAX, i64::MIN)];

    fn stamp(monotonic: i64, wall: i64) -> Stamp {
        let (monotonic_time, wall_time) = (MonotonicTime::from_nanos(monotonic), WallTime::from_unix_nanos(wall));
        Stamp { monotonic_time, wall_time, ..Stamp::default() }
    }

    #[test]
    fn every_time_is_read_back() {
        for (monotonic, wall) in TIMES {
            let stamp = stamp(monotonic, wall);
            let clock = Clock::of(&stamp);
            assert_eq!(clock.logged(&stamp), stamp.wall_time);
            assert_eq!(clock.published(stamp.wall_time), stamp.wall_time);
            assert_eq!(clock.monotonic(stamp.wall_time), stamp.monotonic_time);
            assert_eq!(Clock::from_metadata(&clock.to_metadata()), Some(clock));
        }
    }

    #[test]
    fn log_times_follow_one_clock_though_the_date_was_set() {
        let clock = Clock::of(&stamp(1_000, 1_700_000_000_000_000_000));
        let later = stamp(3_000, 1_800_000_000_000_000_000);
        assert_eq!(clock.logged(&later).as_unix_nanos(), 1_700_000_000_000_002_000);
    }

    #[test]
    fn recordings_with_a_shifted_date_are_read() {
        let metadata = [(OFFSET, "0"), (SHIFT, "1700000000000000000")];
        let metadata = metadata.map(|(key, value)| (key.to_owned(), value.to_owned())).into();
        let clock = Clock::from_metadata(&metadata).expect("it is whole");
        let published = clock.published(WallTime::from_unix_nanos(1_700_000_000_000_000_005));
        assert_eq!((published.as_unix_nanos(), clock.monotonic(published).as_nanos()), (5, 5));
        let broken = [(OFFSET, "0"), (SHIFT, "x")].map(|(key, value)| (key.to_owned(), value.to_owned())).into();
        assert_eq!(Clock::from_metadata(&broken), None);
    }
}
