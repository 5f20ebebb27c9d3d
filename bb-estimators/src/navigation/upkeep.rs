//! What a filter remembers of its own past, and what every filter is asked about it.

/// How often a filter started and bridged a gap, and when its position was last corrected.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::navigation) struct Upkeep {
    pub(in crate::navigation) resets: u32,
    pub(in crate::navigation) gaps: u32,
    /// When the position was last corrected by one of the world.
    pub(in crate::navigation) fixed_ns: i64,
}

impl Upkeep {
    /// The filter has started, or started again.
    pub(in crate::navigation) fn started(&mut self, time_ns: i64) {
        self.resets = self.resets.wrapping_add(1);
        self.fixed_ns = time_ns;
    }

    /// The filter has gone over a gap.
    pub(in crate::navigation) fn bridged(&mut self) {
        self.gaps = self.gaps.wrapping_add(1);
    }
}

/// The methods that tell of a filter's past, for a filter with the fields `estimate`, `covariance` and `upkeep`.
macro_rules! upkeep_methods {
    () => {
        /// Whether the covariance is positive definite now, by a Cholesky decomposition.
        pub fn is_consistent(&self) -> bool {
            self.covariance.is_positive_definite()
        }

        /// How often rounding had made the covariance indefinite, and variances were raised.
        pub fn repairs(&self) -> u64 {
            self.covariance.repairs()
        }

        /// How often the filter was started, or moved to where it was found to be.
        pub fn resets(&self) -> u32 {
            self.upkeep.resets
        }

        /// For how long the horizontal position has not been corrected by one in the world, s: relative poses, velocities
        /// and heights do not count. 0 before the start.
        pub fn dead_reckoning_s(&self) -> f64 {
            let since = |time_ns: i64| time_ns.saturating_sub(self.upkeep.fixed_ns) as f64 * 1e-9;
            self.estimate.as_ref().map_or(0.0, |estimate| since(estimate.time_ns))
        }

        /// How many gaps were bridged.
        pub fn gaps(&self) -> u32 {
            self.upkeep.gaps
        }
    };
}
pub(in crate::navigation) use upkeep_methods;
