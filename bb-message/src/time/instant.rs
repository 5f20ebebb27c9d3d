//! Instants as integers of nanoseconds.
//!
//! Arithmetic saturates, so that a stamp from a broken device causes no overflow panic.

use std::fmt;
use std::ops::{Add, Sub};
use std::time::Duration;

/// An instant of the machine's monotonic clock in nanoseconds: for order and age, never for the calendar.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MonotonicTime(i64);

/// An instant of the calendar in nanoseconds since the Unix epoch: for logs, never for order or age.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct WallTime(i64);

impl MonotonicTime {
    /// The instant 0.
    pub const ZERO: Self = Self(0);
    /// The largest instant: a time that never comes.
    pub const MAX: Self = Self(i64::MAX);

    /// Creates an instant from nanoseconds.
    #[inline]
    pub const fn from_nanos(nanos: i64) -> Self {
        Self(nanos)
    }

    /// Nanoseconds since the clock's zero.
    #[inline]
    pub const fn as_nanos(self) -> i64 {
        self.0
    }

    /// Nanoseconds from `earlier` to `self`, negative if `earlier` is later; saturates.
    #[inline]
    pub const fn nanos_since(self, earlier: Self) -> i64 {
        self.0.saturating_sub(earlier.0)
    }

    /// Seconds from `earlier` to `self`, negative if `earlier` is later.
    #[inline]
    pub const fn seconds_since(self, earlier: Self) -> f64 {
        self.nanos_since(earlier) as f64 * 1e-9
    }

    /// The time from `earlier` to `self`; zero if `earlier` is later.
    #[inline]
    pub const fn duration_since(self, earlier: Self) -> Duration {
        let nanos = self.nanos_since(earlier);
        Duration::from_nanos(if nanos < 0 { 0 } else { nanos as u64 })
    }

    /// Returns the instant `nanos` later; saturates.
    #[inline]
    pub const fn plus_nanos(self, nanos: i64) -> Self {
        Self(self.0.saturating_add(nanos))
    }
}

impl WallTime {
    /// Creates a time from nanoseconds since the Unix epoch.
    #[inline]
    pub const fn from_unix_nanos(nanos: i64) -> Self {
        Self(nanos)
    }

    /// Nanoseconds since the Unix epoch.
    #[inline]
    pub const fn as_unix_nanos(self) -> i64 {
        self.0
    }
}

/// Nanoseconds of a duration, saturating at 292 years.
#[inline]
pub fn nanos_of(duration: Duration) -> i64 {
    i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX)
}

impl Add<Duration> for MonotonicTime {
    type Output = Self;
    #[inline]
    fn add(self, duration: Duration) -> Self {
        self.plus_nanos(nanos_of(duration))
    }
}

impl Sub<Duration> for MonotonicTime {
    type Output = Self;
    #[inline]
    fn sub(self, duration: Duration) -> Self {
        Self(self.0.saturating_sub(nanos_of(duration)))
    }
}

impl fmt::Display for MonotonicTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.9} s", self.0 as f64 * 1e-9)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arithmetic_saturates_instead_of_overflowing() {
        assert_eq!(MonotonicTime::MAX + Duration::from_secs(1), MonotonicTime::MAX);
        let first = MonotonicTime::from_nanos(i64::MIN);
        assert_eq!(first - Duration::MAX, first);
        assert_eq!(MonotonicTime::MAX.nanos_since(first), i64::MAX);
        assert_eq!(first.nanos_since(MonotonicTime::MAX), i64::MIN);
        assert_eq!(first.duration_since(MonotonicTime::MAX), Duration::ZERO);
    }

    #[test]
    fn differences_keep_their_sign() {
        let (a, b) = (MonotonicTime::from_nanos(2_000_000_000), MonotonicTime::from_nanos(500_000_000));
        assert_eq!(a.seconds_since(b), 1.5);
        assert_eq!(b.seconds_since(a), -1.5);
        assert_eq!(a.duration_since(b), Duration::from_millis(1500));
    }
}
