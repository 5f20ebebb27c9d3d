//! Plausibility of IMU stamps. The IMU's clock is that of the queue, and one corrupt stamp must not make all others too old.

use crate::navigation::numbers::{AGREED_NS, BELIEVED_NS, BELIEVED_STAMPS};

/// Result for a stamp.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stamped {
    /// Stamp that is the newest.
    Next,
    /// Stamp before the newest.
    Late,
    /// Stamp that is too far ahead to be believed yet.
    Ahead,
    /// Stamp that is too old to be placed.
    TooOld,
    /// Stamp of a clock that was set back: it and the ones before it are old, or repeat the time of others.
    SetBack {
        /// Time for which stamps have come from the new clock, ns.
        for_ns: i64,
    },
}

/// Samples that are not believed yet.
///
/// A jump is judged the same in both directions. A forward jump may be a gap, and one of more than a minute loses the estimate. A
/// backward jump drops the times of all measurements. A few stamps must not cause either.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Clock {
    doubted: Option<Run>,
}

/// Stamps that agree with one another, but not with the earlier ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Run {
    first_ns: i64,
    last_ns: i64,
    stamps: u32,
}

impl Run {
    /// Extends the run by one stamp. A repeated or late one confirms nothing; one that does not agree starts a new run.
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
    /// Judges a stamp. `longest_ns` is how late a stamp may be to be placed, and how far ahead to be believed at once. `is_surplus`
    /// is whether other samples already cover its time: a clock that was set back by less than `longest_ns` sends such ones alone.
    pub(super) fn judge(&mut self, time_ns: i64, newest_ns: i64, longest_ns: i64, is_surplus: bool) -> Stamped {
        let ahead_ns = time_ns.saturating_sub(newest_ns);
        // A stamp that agrees with the newest is no jump, even if late samples are placed for a shorter time only.
        if (-longest_ns..=longest_ns.max(AGREED_NS)).contains(&ahead_ns) {
            if ahead_ns <= 0 && is_surplus {
                let believed = self.doubt(time_ns);
                return believed.map_or(Stamped::Late, |run| Stamped::SetBack { for_ns: run.length_ns() });
            }
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

    /// Takes a stamp that is not believed on its own. Returns the run that confirms it, if any.
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

/// Returns whether a stamp can be the next sample's after `previous_ns`.
pub(super) fn follows(time_ns: i64, previous_ns: i64) -> bool {
    (1..=AGREED_NS).contains(&time_ns.saturating_sub(previous_ns))
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::collections::BTreeSet;
    use bb_tests::laws;
    use proptest::prelude::*;

    const MS: i64 = 1_000_000;
    const NEWEST: i64 = 100_000;

    fn judged(clock: &mut Clock, millis: i64) -> Stamped {
        clock.judge(millis * MS, NEWEST * MS, 2000 * MS, false)
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
        assert_eq!(Clock::default().judge(i64::MIN, i64::MAX, 0, false), Stamped::TooOld);
        assert_eq!(Clock::default().judge(i64::MAX, i64::MIN, 0, false), Stamped::Ahead);
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

    /// A second ahead is no jump, with any time limit for late samples.
    #[test]
    fn a_second_ahead_is_no_jump() {
        for lateness in [0, 50, 2000] {
            let stamped = Clock::default().judge((NEWEST + 1000) * MS, NEWEST * MS, lateness * MS, false);
            assert_eq!(stamped, Stamped::Next);
        }
    }

    /// Half a second of stamps, none of them new, at times that are covered already: too old to be placed at first, or not.
    #[test]
    fn a_clock_that_is_set_back_a_little_repeats_time() {
        for first in [97_900, 98_000, 99_000] {
            let mut clock = Clock::default();
            let mut late = |millis: i64| clock.judge(millis * MS, NEWEST * MS, 2000 * MS, true);
            for millis in (first..first + 500).step_by(5) {
                let doubted = if millis < 98_000 { Stamped::TooOld } else { Stamped::Late };
                assert_eq!(late(millis), doubted, "{millis}");
            }
            assert_eq!(late(first + 500), Stamped::SetBack { for_ns: 500 * MS });
        }
        // Late samples between new ones, or where none was, are late.
        for is_surplus in [true, false] {
            let mut clock = Clock::default();
            for millis in (99_000..100_000).step_by(5) {
                let time_ns = millis * MS;
                assert_eq!(clock.judge(time_ns, NEWEST * MS, 2000 * MS, is_surplus), Stamped::Late);
                if is_surplus && millis % 100 == 0 {
                    assert_eq!(judged(&mut clock, NEWEST + 5), Stamped::Next);
                }
            }
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

    laws! {
        /// A jump needs its evidence: enough stamps since the last one near the clock, which rise for half a second.
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
                    // The stamps that lead up to it in steps of at most a second.
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
