//! When the estimate is not to be trusted.

use super::filter::Filter;
use super::input::Mounting;
use super::options::NavigationOptions;
use crate::navigation::history::Replayed as _;

/// For how long the filter is distrusted after it had to be pulled towards its sensors, ns.
const DISTRUST_NS: i64 = 1_000_000_000;

/// Refusals in a row of one sensor that are more than outliers.
const STORM: u64 = 3;

/// What was seen of the filter so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Watch {
    has_positions: bool,
    recoveries: u64,
    distrusted_until_ns: i64,
}

impl Watch {
    pub(super) fn new(mounting: &Mounting) -> Self {
        Self { has_positions: mounting.has_positions(), recoveries: 0, distrusted_until_ns: i64::MIN }
    }

    /// Why the estimate is not to be trusted, if it is not.
    pub(super) fn look(&mut self, filter: &Filter, options: &NavigationOptions) -> Option<&'static str> {
        let now_ns = filter.time_ns()?;
        let counts = filter.counts();
        let recoveries = counts.iter().map(|counts| counts.recoveries).sum();
        // A late measurement has the filter take back a recovery, and perhaps make it again.
        if recoveries > self.recoveries {
            self.distrusted_until_ns = now_ns.saturating_add(DISTRUST_NS);
        }
        self.recoveries = recoveries;
        if now_ns < self.distrusted_until_ns || counts.iter().any(|counts| counts.gate_in_a_row >= STORM) {
            return Some("its sensors do not agree with it");
        }
        if self.has_positions && filter.eskf().dead_reckoning_s() > options.longest_dead_reckoning {
            return Some("the position was dead-reckoned for too long");
        }
        (filter.horizontal_deviation() > options.largest_deviation).then_some("the position is too uncertain")
    }
}
