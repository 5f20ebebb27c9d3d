//! Prediction from the newest estimate with each sample of the IMU, for outputs between keyframes.

use super::Pose;
use crate::navigation::copies::{CopiedFilter as _, Holding};
use crate::navigation::eskf::{EskfFilter, ImuMean};
use crate::navigation::propagate::Propagate as _;
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{NAVIGATED, Navigated};

/// A filter that is never corrected. Over a gap it holds the reading as the copies do.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation::state_estimator) struct Predictor {
    pub(super) filter: EskfFilter<Navigated, NAVIGATED>,
    pub(super) holding: Holding,
}

impl Predictor {
    pub(in crate::navigation::state_estimator) fn time_ns(&self) -> i64 {
        self.filter.time_ns().unwrap_or(i64::MIN)
    }

    /// Advances over a sample, or the rest of it. `last` is the reading before it, and its time that at which the sample begins.
    pub(in crate::navigation::state_estimator) fn propagate(
        &mut self,
        last: &ImuMean,
        sample: &ImuMean,
    ) -> Result<(), Refusal> {
        let longest_s = self.filter.params().longest_sample;
        let part_ns = [self.time_ns(), sample.time_ns];
        match self.holding.held(last, sample, last.time_ns, longest_s, part_ns, self.filter.is_moving())? {
            Some((held, doubt)) => self.filter.hold(&held, &doubt),
            None => self.filter.advance(sample),
        }
    }

    /// The pose at a time after the newest sample, whose reading is held until then. What the samples have shown of gaps does not count:
    /// nothing is known of the reading at the end.
    pub(in crate::navigation::state_estimator) fn pose_at(&self, time_ns: i64, newest: &ImuMean) -> Option<Pose> {
        let mut ahead = self.filter;
        ahead.propagate(&ImuMean { time_ns, ..*newest }).ok()?;
        pose(&ahead)
    }

    pub(in crate::navigation::state_estimator) fn pose(&self) -> Option<Pose> {
        pose(&self.filter)
    }
}

fn pose(filter: &EskfFilter<Navigated, NAVIGATED>) -> Option<Pose> {
    filter.estimate().map(|estimate| Pose::of(estimate, filter.covariance()))
}
