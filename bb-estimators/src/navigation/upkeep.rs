//! Counts of a filter's starts and gaps, and the queries common to all filters.

/// Counts of a filter's starts and bridged gaps, and the time at which its position was last corrected.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::navigation) struct Upkeep {
    pub(in crate::navigation) resets: u32,
    pub(in crate::navigation) gaps: u32,
    /// Time at which the position was last corrected by a position in the world.
    pub(in crate::navigation) fixed_ns: i64,
}

impl Upkeep {
    /// Records that the filter has started or restarted.
    pub(in crate::navigation) fn started(&mut self, time_ns: i64) {
        self.resets = self.resets.wrapping_add(1);
        self.fixed_ns = time_ns;
    }

    /// Records that the filter has bridged a gap.
    pub(in crate::navigation) fn bridged(&mut self) {
        self.gaps = self.gaps.wrapping_add(1);
    }
}

/// Methods that report a filter's past, for a filter with the fields `estimate`, `covariance` and `upkeep`.
macro_rules! upkeep_methods {
    () => {
        /// Returns whether the covariance is currently positive definite, by a Cholesky decomposition.
        pub fn is_consistent(&self) -> bool {
            self.covariance.is_positive_definite()
        }

        /// Returns the number of times that rounding had made the covariance indefinite, so that variances were raised.
        pub fn repairs(&self) -> u64 {
            self.covariance.repairs()
        }

        /// Returns the number of times that the filter was started or relocated.
        pub fn resets(&self) -> u32 {
            self.upkeep.resets
        }

        /// Time since the horizontal position was last corrected by a position in the world, s. Relative poses, velocities and
        /// heights do not count. 0 before the start.
        pub fn dead_reckoning_s(&self) -> f64 {
            let since = |time_ns: i64| time_ns.saturating_sub(self.upkeep.fixed_ns) as f64 * 1e-9;
            self.estimate.as_ref().map_or(0.0, |estimate| since(estimate.time_ns))
        }

        /// The number of gaps bridged; one that measurements divide counts once for each part.
        pub fn gaps(&self) -> u32 {
            self.upkeep.gaps
        }
    };
}
pub(in crate::navigation) use upkeep_methods;
