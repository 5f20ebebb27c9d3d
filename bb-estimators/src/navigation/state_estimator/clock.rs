//! Which stamps of the IMU are believed: its clock is that of the queue, and one broken stamp must not make all others too old.

/// Two stamps that agree are at most this far apart, ns.
const AGREED_NS: i64 = 1_000_000_000;

/// A clock that was set back is believed once its samples have gone on for this long, and none has come from the former, ns.
const SET_BACK_NS: i64 = 500_000_000;

/// What a stamp says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stamped {
    /// It is the newest.
    Next,
    /// It belongs before the newest.
    Late,
    /// It is too far ahead to be believed alone.
    Ahead,
    /// It is older than what can be placed.
    TooOld,
    /// So are those before it: the clock was set back.
    SetBack,
}

/// Samples that are not believed yet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Clock {
    /// The first stamp of them, and the last.
    doubted: Option<(i64, i64)>,
}

impl Clock {
    /// Judges a stamp; `longest_ns` is how far ahead one is believed, and how late one is placed.
    pub(super) fn judge(&mut self, time_ns: i64, newest_ns: i64, longest_ns: i64) -> Stamped {
        let ahead_ns = time_ns.saturating_sub(newest_ns);
        if ahead_ns.saturating_abs() <= longest_ns {
            self.doubted = None;
            return if ahead_ns > 0 { Stamped::Next } else { Stamped::Late };
        }
        let refused = if ahead_ns > 0 { Stamped::Ahead } else { Stamped::TooOld };
        let (first_ns, last_ns) = match self.doubted {
            // A link that repeats samples confirms nothing.
            Some((_, last_ns)) if last_ns == time_ns => return refused,
            Some((first_ns, last_ns)) if follows(time_ns, last_ns) => (first_ns, last_ns),
            _ => {
                self.doubted = Some((time_ns, time_ns));
                return refused;
            }
        };
        self.doubted = Some((first_ns, time_ns));
        let is_believed = match refused {
            Stamped::Ahead => last_ns > newest_ns,
            _ => time_ns.saturating_sub(first_ns) >= SET_BACK_NS,
        };
        if !is_believed {
            return refused;
        }
        self.doubted = None;
        if ahead_ns > 0 { Stamped::Next } else { Stamped::SetBack }
    }
}

/// Whether a stamp may be that of the sample after another.
pub(super) fn follows(time_ns: i64, previous_ns: i64) -> bool {
    (1..=AGREED_NS).contains(&time_ns.saturating_sub(previous_ns))
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    fn judged(clock: &mut Clock, millis: i64) -> Stamped {
        clock.judge(millis * MS, 100_000 * MS, 2000 * MS)
    }

    #[test]
    fn one_stamp_alone_moves_nothing() {
        for millis in [102_001, 150_000, i64::MAX / MS] {
            let mut clock = Clock::default();
            assert_eq!(judged(&mut clock, millis), Stamped::Ahead);
            assert_eq!(judged(&mut clock, millis), Stamped::Ahead, "repeated");
            assert_eq!(judged(&mut clock, 100_005), Stamped::Next);
            assert_eq!(judged(&mut clock, millis), Stamped::Ahead, "and again");
        }
        assert_eq!(Clock::default().judge(i64::MIN, i64::MAX, 0), Stamped::TooOld);
        assert_eq!(Clock::default().judge(i64::MAX, i64::MIN, 0), Stamped::Ahead);
    }

    #[test]
    fn two_stamps_that_agree_are_a_gap() {
        let mut clock = Clock::default();
        assert_eq!([103_000, 103_005].map(|millis| judged(&mut clock, millis)), [Stamped::Ahead, Stamped::Next]);
    }

    #[test]
    fn half_a_second_of_stamps_is_a_clock_that_was_set_back() {
        let mut clock = Clock::default();
        assert!((0..500).step_by(5).all(|millis| judged(&mut clock, millis) == Stamped::TooOld));
        assert_eq!(judged(&mut clock, 500), Stamped::SetBack);
    }

    #[test]
    fn a_burst_of_old_samples_between_new_ones_is_not() {
        let mut clock = Clock::default();
        for millis in 0..2000 {
            let stamp = if millis % 100 == 50 { 99_000 + millis } else { millis };
            let expected = match (millis % 100, stamp > 100_000) {
                (50, true) => Stamped::Next,
                (50, false) => Stamped::Late,
                _ => Stamped::TooOld,
            };
            assert_eq!(judged(&mut clock, stamp), expected);
        }
    }
}
