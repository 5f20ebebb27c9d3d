//! Conditions under which the estimate is not to be trusted.

use crate::navigation::numbers::{DISTRUST_NS, STORM, UNKNOWN_HEADING};
use crate::navigation::stream::Counts;

/// Observations of the filter so far.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation) struct Watch {
    limits: Limits,
    /// Number of resets already seen. 1 after the start.
    resets: u32,
    moved_until_ns: i64,
}

/// Limits of an estimate.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation) struct Limits {
    /// Time for which the position may be dead-reckoned, s. `None` if no sensor measures it.
    pub(in crate::navigation) dead_reckoning_s: Option<f64>,
    /// Standard deviation of the horizontal position, m.
    pub(in crate::navigation) deviation: f64,
}

/// Observable quantities of a filter.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation) struct Sight<'a> {
    pub(in crate::navigation) now_ns: i64,
    pub(in crate::navigation) counts: &'a [&'a Counts],
    /// Number of times the filter was started or moved.
    pub(in crate::navigation) resets: u32,
    pub(in crate::navigation) dead_reckoning_s: f64,
    /// Standard deviation of the horizontal position in its least certain direction, m.
    pub(in crate::navigation) deviation: f64,
    /// Standard deviation of the heading, rad.
    pub(in crate::navigation) heading_deviation: f64,
}

impl Watch {
    pub(in crate::navigation) fn new(limits: Limits) -> Self {
        Self { limits, resets: 1, moved_until_ns: i64::MIN }
    }

    /// Returns the reason for which the estimate is not to be trusted, if there is one.
    pub(in crate::navigation) fn look(&mut self, sight: &Sight<'_>) -> Option<&'static str> {
        if sight.resets > self.resets {
            self.resets = sight.resets;
            self.moved_until_ns = sight.now_ns.saturating_add(DISTRUST_NS);
        }
        if sight.now_ns < self.moved_until_ns {
            return Some("it was wrong, and began again where positions agree");
        }
        if sight.counts.iter().any(|counts| counts.gate_in_a_row >= STORM) {
            return Some("its sensors do not agree with it");
        }
        if self.limits.dead_reckoning_s.is_some_and(|longest_s| sight.dead_reckoning_s > longest_s) {
            return Some("the position was dead-reckoned for too long");
        }
        // NaN is not known either.
        let is_heading_known = sight.heading_deviation <= UNKNOWN_HEADING;
        if !is_heading_known {
            return Some("the heading is not known yet");
        }
        // A NaN deviation carries no information.
        let is_certain = sight.deviation <= self.limits.deviation;
        (!is_certain).then_some("the position is too uncertain")
    }
}

/// The largest standard deviation in any direction, from a 2×2 covariance.
pub(in crate::navigation) fn largest_deviation(xx: f64, xy: f64, yy: f64) -> f64 {
    let (mean, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
    (mean + half.hypot(xy)).sqrt()
}
