//! Which stamps of the IMU are believed: its clock is that of the queue, and one broken stamp must not make all others too old.

/// Two stamps that agree are at most this far apart, ns.
const AGREED_NS: i64 = 1_000_000_000;

/// A jump of the clock is believed once stamps that agree have gone on for this long, ns, and none has come from the former
/// clock.
const BELIEVED_NS: i64 = 500_000_000;

/// There are at least this many of them.
const BELIEVED_STAMPS: u32 = 5;

/// What a stamp says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stamped {
    /// It is the newest.
    Next,
    /// It belongs before the newest.
    Late,
    /// It is too far ahead to be believed yet.
    Ahead,
    /// It is older than what can be placed.
    TooOld,
    /// So are those before it: the clock was set back.
    SetBack {
        /// For how long stamps have come from the new clock, ns.
        for_ns: i64,
    },
}

/// Samples that are not believed yet.
///
/// A jump is weighed alike in both directions. Forwards, it may be a gap, and one of more than a minute loses the estimate;
/// backwards, it forgets the times of what was measured. A few stamps must not do either.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Clock {
    doubted: Option<Run>,
}

/// Stamps that agree with one another, and not with those before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Run {
    first_ns: i64,
    last_ns: i64,
    stamps: u32,
}

impl Run {
    /// The run with one stamp more. One that is repeated or overtaken confirms nothing; one that does not agree begins another.
    fn with(self, time_ns: i64) -> Self {
        match time_ns.saturating_sub(self.last_ns) {
            1..=AGREED_NS => Self { last_ns: time_ns, stamps: self.stamps.saturating_add(1), ..self },
            since_ns if (-AGREED_NS..=0).contains(&since_ns) => self,
            _ => Self::of(time_ns),
        }
    }

    fn of(time_ns: i64) -> Self {
        Self { first_ns: time_ns, last_ns: time_ns, stamps: 1 }
    }

    fn length_ns(&self) -> i64 {
        self.last_ns.saturating_sub(self.first_ns)
    }

    fn is_believed(&self) -> bool {
        self.stamps >= BELIEVED_STAMPS && self.length_ns() >= BELIEVED_NS
    }
}

impl Clock {
    /// Judges a stamp; `longest_ns` is how late one is placed, and how far ahead one is believed at once.
    pub(super) fn judge(&mut self, time_ns: i64, newest_ns: i64, longest_ns: i64) -> Stamped {
        let ahead_ns = time_ns.saturating_sub(newest_ns);
        // What agrees with the newest is no jump, however short the time is in which late ones are placed.
        if (-longest_ns..=longest_ns.max(AGREED_NS)).contains(&ahead_ns) {
            self.doubted = None;
            return if ahead_ns > 0 { Stamped::Next } else { Stamped::Late };
        }
        match self.doubt(time_ns) {
            Some(_) if ahead_ns > 0 => Stamped::Next,
            Some(run) => Stamped::SetBack { for_ns: run.length_ns() },
            None if ahead_ns > 0 => Stamped::Ahead,
            None => Stamped::TooOld,
        }
    }

    /// Takes a stamp that is not believed by itself; the run that confirms it, if one does.
    pub(super) fn doubt(&mut self, time_ns: i64) -> Option<Run> {
        let run = self.doubted.map_or(Run::of(time_ns), |run| run.with(time_ns));
        self.doubted = Some(run);
        if !run.is_believed() {
            return None;
        }
        self.doubted = None;
        Some(run)
    }
}

/// Whether a stamp may be that of the sample after another.
pub(super) fn follows(time_ns: i64, previous_ns: i64) -> bool {
    (1..=AGREED_NS).contains(&time_ns.saturating_sub(previous_ns))
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::collections::BTreeSet;
    use proptest::prelude::*;

    const MS: i64 = 1_000_000;
    const NEWEST: i64 = 100_000;

    fn judged(clock: &mut Clock, millis: i64) -> Stamped {
        clock.judge(millis * MS, NEWEST * MS, 2000 * MS)
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
    fn half_a_second_of_stamps_is_a_jump_in_both_directions() {
        for (first, doubted, believed) in [
            (103_000, Stamped::Ahead, Stamped::Next),
            (3_700_000, Stamped::Ahead, Stamped::Next),
            (0, Stamped::TooOld, Stamped::SetBack { for_ns: 500 * MS }),
        ] {
            let mut clock = Clock::default();
            assert!((0..500).step_by(5).all(|millis| judged(&mut clock, first + millis) == doubted));
            assert_eq!(judged(&mut clock, first + 500), believed);
        }
    }

    #[test]
    fn stamps_that_agree_are_five_at_least() {
        for (first, doubted) in [(200_000, Stamped::Ahead), (0, Stamped::TooOld)] {
            let mut clock = Clock::default();
            assert!((0..4).all(|second| judged(&mut clock, first + 1000 * second) == doubted));
            assert_ne!(judged(&mut clock, first + 4000), doubted);
        }
    }

    /// However short the time in which late ones are placed.
    #[test]
    fn a_second_ahead_is_no_jump() {
        for lateness in [0, 50, 2000] {
            let stamped = Clock::default().judge((NEWEST + 1000) * MS, NEWEST * MS, lateness * MS);
            assert_eq!(stamped, Stamped::Next);
        }
    }

    #[test]
    fn a_burst_of_old_samples_between_new_ones_is_no_jump() {
        let mut clock = Clock::default();
        for millis in 0..2000 {
            let stamp = if millis % 100 == 50 { 99_000 + millis } else { millis };
            let expected = match (millis % 100, stamp > NEWEST) {
                (50, true) => Stamped::Next,
                (50, false) => Stamped::Late,
                _ => Stamped::TooOld,
            };
            assert_eq!(judged(&mut clock, stamp), expected);
        }
    }

    proptest! {
        /// Whatever comes: a jump has enough stamps since the last one that was near, and they rise for half a second.
        #[test]
        fn a_jump_needs_its_evidence(
            stamps in prop::collection::vec(prop_oneof![
                4 => (0..4_i64, 0..40_i64).prop_map(|(clock, step)| [3_000, 90_000, 200_000, 9_000_000][clock as usize] + 25 * step),
                1 => Just(NEWEST + 5),
            ], 1..200),
        ) {
            let mut clock = Clock::default();
            let mut doubted: Vec<i64> = Vec::new();
            for millis in stamps {
                let stamped = judged(&mut clock, millis);
                if (millis - NEWEST).abs() <= 2000 {
                    doubted.clear();
                    continue;
                }
                doubted.push(millis);
                if matches!(stamped, Stamped::Next | Stamped::SetBack { .. }) {
                    // Those that lead up to it in steps of at most a second.
                    let all: BTreeSet<i64> = doubted.iter().copied().filter(|other| *other <= millis).collect();
                    let mut first = millis;
                    let steps = all.iter().rev().take_while(|other| {
                        let agrees = first - **other <= 1_000;
                        first = if agrees { **other } else { first };
                        agrees
                    });
                    let count = steps.count();
                    prop_assert!(count >= BELIEVED_STAMPS as usize && millis - first >= 500, "{count} from {first} to {millis}");
                    doubted.clear();
                }
            }
        }
    }
}
