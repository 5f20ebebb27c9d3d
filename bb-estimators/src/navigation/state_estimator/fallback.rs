//! Fallback when there is no estimate for too long.

use super::event::EventKind;
use super::params::{StateEstimatorParams, ns};

/// Measures the time without an estimate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Watchdog {
    /// The last tick with an estimate. Before there is one, the first tick.
    last_ns: Option<i64>,
    is_warned: bool,
    is_engaged: bool,
}

impl Watchdog {
    pub(super) fn is_engaged(&self) -> bool {
        self.is_engaged
    }

    /// Takes a tick. Each change is returned once.
    pub(super) fn tick(
        &mut self,
        now_ns: i64,
        has_estimate: bool,
        params: &StateEstimatorParams,
    ) -> Option<EventKind> {
        if has_estimate {
            let was_engaged = self.is_engaged;
            *self = Self { last_ns: Some(now_ns), ..Self::default() };
            return was_engaged.then_some(EventKind::FallbackRecovered);
        }
        // If the clock was set back, the time is measured from there.
        let last_ns = self.last_ns.unwrap_or(now_ns).min(now_ns);
        self.last_ns = Some(last_ns);
        let without_ns = now_ns.saturating_sub(last_ns);
        if !self.is_engaged && without_ns >= ns(params.fallback_after) {
            (self.is_engaged, self.is_warned) = (true, true);
            return Some(EventKind::FallbackEngaged);
        }
        if !self.is_warned && without_ns >= ns(params.fallback_after * 2.0 / 3.0) {
            self.is_warned = true;
            return Some(EventKind::FallbackImminent);
        }
        None
    }
}
