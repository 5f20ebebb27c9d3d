//! Prediction from the newest estimate with each sample of the IMU, for outputs between keyframes.

use super::Pose;
use crate::navigation::eskf::{EskfFilter, ImuMean};
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{NAVIGATED, Navigated};

/// A filter that is never corrected.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation::state_estimator) struct Predictor(EskfFilter<Navigated, NAVIGATED>);

impl Predictor {
    /// A copy of the filter.
    pub(super) fn of(filter: &EskfFilter<Navigated, NAVIGATED>) -> Self {
        Self(*filter)
    }

    pub(in crate::navigation::state_estimator) fn time_ns(&self) -> i64 {
        self.0.estimate().map_or(i64::MIN, |estimate| estimate.time_ns)
    }

    pub(in crate::navigation::state_estimator) fn propagate(
        &mut self,
        sample: &ImuMean,
        is_gap: bool,
    ) -> Result<(), Refusal> {
        self.0.propagate_part(sample, is_gap)
    }

    pub(in crate::navigation::state_estimator) fn pose(&self) -> Option<Pose> {
        self.0.estimate().map(|estimate| Pose::of(estimate, self.0.covariance()))
    }
}
