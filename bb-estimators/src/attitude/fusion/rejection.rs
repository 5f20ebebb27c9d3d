//! Whether a sensor is ignored, and for how long: rejection and recovery of the library's documentation.

/// A sample that is taken counts this many times against recovery what one that is rejected counts for it: recovery is
/// for more than 90 % of rejected samples.
const TAKEN_WEIGHT: f64 = 9.0;

/// Rejection of one sensor.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Rejection {
    /// From 0 to the recovery time, s.
    trigger_s: f64,
    recovering: bool,
    ignored: bool,
}

impl Rejection {
    pub(super) fn new() -> Self {
        Self { trigger_s: 0.0, recovering: false, ignored: false }
    }

    /// Whether the last sample was ignored.
    pub(super) fn is_ignored(&self) -> bool {
        self.ignored
    }

    /// Whether to take a sample that is, or is not, `near` what is expected.
    #[inline]
    pub(super) fn takes(&mut self, dt_s: f64, recovery_time_s: f64, near: bool) -> bool {
        self.trigger_s += if near { -TAKEN_WEIGHT * dt_s } else { dt_s };
        if self.trigger_s > recovery_time_s {
            self.recovering = true;
        } else if self.trigger_s <= 0.0 {
            self.recovering = false;
        }
        self.trigger_s = self.trigger_s.clamp(0.0, recovery_time_s);
        self.ignored = !near && !self.recovering;
        !self.ignored
    }
}
