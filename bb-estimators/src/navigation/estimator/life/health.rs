//! Conditions under which the estimate is not to be trusted.

use super::{Sensed, Sensing};
use crate::navigation::numbers::{DISTRUST_NS, STORM, UNKNOWN_HEADING};

/// Observations of the filter so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Watch {
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

impl Watch {
    pub(super) fn new(limits: Limits) -> Self {
        Self { limits, resets: 1, moved_until_ns: i64::MIN }
    }

    /// Returns the reason for which the estimate is not to be trusted, if there is one.
    pub(super) fn look<F: Sensing>(&mut self, sensed: &Sensed<F>) -> Option<&'static str> {
        let filter = sensed.best();
        let now_ns = filter.time_ns()?;
        if filter.resets() > self.resets {
            self.resets = filter.resets();
            self.moved_until_ns = now_ns.saturating_add(DISTRUST_NS);
        }
        if now_ns < self.moved_until_ns {
            return Some("it was wrong, and began again where positions agree");
        }
        if sensed.streams.iter().any(|stream| stream.counts().gate_in_a_row >= STORM) {
            return Some("its sensors do not agree with it");
        }
        if self.limits.dead_reckoning_s.is_some_and(|longest_s| filter.dead_reckoning_s() > longest_s) {
            return Some("the position was dead-reckoned for too long");
        }
        // NaN is not known either.
        let is_heading_known = sensed.copies.heading_deviation() <= UNKNOWN_HEADING;
        if !is_heading_known {
            return Some("the heading is not known yet");
        }
        // A NaN deviation carries no information.
        let is_certain = sensed.deviation() <= self.limits.deviation;
        (!is_certain).then_some("the position is too uncertain")
    }
}
