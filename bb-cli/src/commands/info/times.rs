//! Remarks on the times of a topic.

use super::remark::{Remark, Subject};
use bb_eval::Periods;
use bb_eval::table::counted;

/// The times of the messages of a topic.
#[derive(Debug, Default)]
pub(super) struct Times {
    /// `true` if messages come only when something happens.
    of_events: bool,
    /// True if several may happen at one instant, as the commands of a robot do.
    may_repeat: bool,
    log_ns: Vec<i64>,
    /// The times in the headers, as long as all messages have one.
    stamp_ns: Vec<i64>,
}

/// The clocks of the log and of the stamps agree within this; if not, one of them has jumped.
const JUMP_S: f64 = 1.0;

impl Times {
    pub(super) fn new(of_events: bool, may_repeat: bool) -> Self {
        Self { of_events, may_repeat: may_repeat || of_events, ..Self::default() }
    }

    pub(super) fn push(&mut self, log_ns: i64, stamp_ns: Option<i64>) {
        self.log_ns.push(log_ns);
        self.stamp_ns.extend(stamp_ns);
    }

    pub(super) fn count(&self) -> usize {
        self.log_ns.len()
    }

    /// The measurement times, if the headers have them.
    fn measured(&self) -> &[i64] {
        if self.stamp_ns.len() == self.log_ns.len() { &self.stamp_ns } else { &self.log_ns }
    }

    pub(super) fn periods(&self) -> Option<Periods> {
        let periods = Periods::of(self.measured());
        if self.of_events { periods.map(Periods::of_events) } else { periods }
    }

    /// Gaps and jumps, each by the time since the start of the recording.
    pub(super) fn remarks(&self, start_ns: i64) -> Vec<Remark> {
        let mut remarks = Vec::new();
        let at = |index: usize| seconds(self.log_ns[index].saturating_sub(start_ns));
        let has_stamps = self.stamp_ns.len() == self.log_ns.len();
        if !self.stamp_ns.is_empty() && !has_stamps {
            let without = self.log_ns.len() - self.stamp_ns.len();
            remarks.push(Remark::new(Subject::Clock, format!("{without} stamps are zero")));
        }
        let Some(periods) = self.periods() else { return remarks };
        if let Some(longest) = periods.gaps.iter().max_by(|a, b| a.length_s.total_cmp(&b.length_s)) {
            let count = counted(periods.gaps.len(), "gap", "gaps");
            remarks.push(Remark::new(
                Subject::Gap,
                format!(
                    "{count} of more than 3 periods; the longest is {:.3} s, after {:.3} s",
                    longest.length_s,
                    at(longest.after)
                ),
            ));
        }
        remarks.extend(periods.jitter.filter(|_| has_stamps).map(|jitter| {
            let ms = |seconds: f64| seconds * 1e3;
            Remark::new(
                Subject::Clock,
                format!(
                    "the stamps jitter: of the periods of {:.1} ms, one in ten is off by {:.1} ms or more",
                    ms(jitter.period_s),
                    ms(jitter.deviation_s)
                ),
            )
        }));
        let (what, one, many) = if has_stamps {
            ("stamp", "stamp goes", "stamps go")
        } else {
            ("log time", "log time goes", "log times go")
        };
        let back = |index: &usize| seconds(self.measured()[*index].saturating_sub(self.measured()[index - 1]));
        if let Some(farthest) = periods.backward.iter().min_by(|a, b| back(a).total_cmp(&back(b))) {
            let count = counted(periods.backward.len(), one, many);
            let (farthest_s, at_s) = (-back(farthest), at(*farthest));
            remarks.push(Remark::new(
                Subject::Clock,
                format!("{count} back in time; the farthest by {farthest_s:.6} s, at {at_s:.3} s"),
            ));
        }
        if periods.repeated > 0 && has_stamps && !self.may_repeat {
            let count = periods.repeated;
            let text = match count {
                1 => format!("1 message has the {what} of the one before"),
                _ => format!("{count} messages have the {what} of the one before"),
            };
            remarks.push(Remark::new(Subject::Clock, text));
        }
        if has_stamps {
            remarks.extend(self.clocks(&at));
        }
        remarks
    }

    /// Remarks on whether the log and the stamps use the same clock.
    fn clocks(&self, at: &dyn Fn(usize) -> f64) -> Vec<Remark> {
        let mut remarks = Vec::new();
        let offset = |index: usize| seconds(self.log_ns[index].saturating_sub(self.stamp_ns[index]));
        let jumps: Vec<usize> =
            (1..self.log_ns.len()).filter(|index| (offset(*index) - offset(index - 1)).abs() > JUMP_S).collect();
        if let Some(first) = jumps.first().copied() {
            let step = |times: &[i64]| seconds(times[first].saturating_sub(times[first - 1]));
            let count = counted(jumps.len(), "clock jump", "clock jumps");
            let text = format!(
                "{count}: at {:.3} s the log time goes on by {:.3} s and the stamp by {:.3} s",
                at(first),
                step(&self.log_ns),
                step(&self.stamp_ns)
            );
            remarks.push(Remark::new(Subject::Clock, text));
        }
        let mut offsets: Vec<f64> = (0..self.log_ns.len()).map(offset).collect();
        offsets.sort_by(f64::total_cmp);
        let median = offsets.get(offsets.len() / 2).copied().unwrap_or(0.0);
        if median.abs() > JUMP_S {
            let order = if median > 0.0 { "before" } else { "after" };
            let text = format!(
                "the stamps are {:.3} s {order} the log times: by another clock, or logged at another time",
                median.abs()
            );
            remarks.push(Remark::new(Subject::Clock, text));
        }
        remarks
    }
}

fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    /// 100 messages at 100 Hz, with the stamp that `stamp` makes of the index and of the time.
    fn remarks(log: impl Fn(i64) -> i64, stamp: impl Fn(i64) -> i64) -> Vec<String> {
        let mut times = Times::default();
        for index in 0..100 {
            times.push(5_000 * MS + log(index), Some(5_000 * MS + stamp(index)));
        }
        times.remarks(5_000 * MS).into_iter().map(|remark| remark.text).collect()
    }

    const EVEN: fn(i64) -> i64 = |index| index * 10 * MS;

    #[test]
    fn a_good_topic_has_no_remarks() {
        assert_eq!(remarks(EVEN, EVEN), [""; 0]);
    }

    #[test]
    fn gaps_and_stamps_that_go_back_are_reported_with_their_places() {
        let gap = |index| EVEN(index) + if index > 40 { 500 * MS } else { 0 };
        assert_eq!(remarks(gap, gap), ["1 gap of more than 3 periods; the longest is 0.510 s, after 0.400 s"]);
        let back = |index| EVEN(index) - if index == 30 { 25 * MS } else { 0 };
        assert_eq!(
            remarks(EVEN, back),
            [
                // 290 ms, 275 ms, 310 ms: the stamp itself, and the way back to the others.
                "1 gap of more than 3 periods; the longest is 0.035 s, after 0.300 s",
                "1 stamp goes back in time; the farthest by 0.015000 s, at 0.300 s"
            ]
        );
        let twice = |index| EVEN(index - index % 2);
        assert_eq!(remarks(EVEN, twice), ["50 messages have the stamp of the one before"]);
    }

    #[test]
    fn stamps_that_jitter_are_reported_and_missing_messages_are_not() {
        let jitter = |index| EVEN(index) + (index * 7 % 11 - 5) * MS / 2;
        let said = remarks(EVEN, jitter);
        assert_eq!(said, ["the stamps jitter: of the periods of 10.0 ms, one in ten is off by 3.5 ms or more"]);
        let rounded = |index| EVEN(index) + (index * 7 % 11 - 5) * MS / 10;
        assert_eq!(remarks(EVEN, rounded), [""; 0]);
        // Every fourth message is elsewhere.
        let held_out = |index| EVEN(index + index / 3);
        assert_eq!(remarks(held_out, held_out), [""; 0]);
    }

    #[test]
    fn events_may_happen_at_one_instant() {
        let remarks = |of_events| {
            let mut times = Times::new(of_events, false);
            (0..20).for_each(|index| times.push(5_000 * MS + index / 2, Some(5_000 * MS + index / 2)));
            times.remarks(5_000 * MS).len()
        };
        assert_eq!((remarks(false), remarks(true)), (1, 0));
    }

    #[test]
    fn clocks_that_differ_are_reported() {
        let later = |index| EVEN(index) - 3_600_000 * MS;
        assert_eq!(
            remarks(EVEN, later),
            ["the stamps are 3600.000 s before the log times: by another clock, or logged at another time"]
        );
        let set = |index| EVEN(index) + if index >= 60 { 7_200_000 * MS } else { 0 };
        assert_eq!(
            remarks(set, EVEN)[0],
            "1 clock jump: at 7200.600 s the log time goes on by 7200.010 s and the stamp by 0.010 s"
        );
    }
}
