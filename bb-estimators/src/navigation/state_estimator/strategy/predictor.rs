//! Prediction from the newest estimate with each sample of the IMU, for outputs between keyframes.

use super::Pose;
#[cfg(feature = "smoother")]
use crate::navigation::eskf::EskfParams;
use crate::navigation::eskf::{Eskf, ImuMean};
use crate::navigation::refusal::Refusal;
#[cfg(feature = "smoother")]
use crate::navigation::state::{Estimate, Navigation, States};
#[cfg(feature = "eskf")]
use crate::navigation::state::{NAVIGATED, Navigated};
#[cfg(feature = "smoother")]
use nalgebra::SMatrix;

#[allow(clippy::large_enum_variant, reason = "there is one of it, and one variant where one strategy was built")]
/// A filter that is never corrected.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation::state_estimator) enum Predictor {
    /// Filter that starts at a keyframe of the smoother.
    #[cfg(feature = "smoother")]
    FromKeyframe(Eskf<Navigation>),
    /// A copy of the filter.
    #[cfg(feature = "eskf")]
    Copy(Eskf<Navigated, NAVIGATED>),
}

macro_rules! each {
    ($self:expr, $filter:ident => $do:expr) => {
        match $self {
            #[cfg(feature = "smoother")]
            Predictor::FromKeyframe($filter) => $do,
            #[cfg(feature = "eskf")]
            Predictor::Copy($filter) => $do,
        }
    };
}

impl Predictor {
    #[cfg(feature = "smoother")]
    pub(super) fn from_keyframe<S: States, const N: usize>(
        params: &EskfParams,
        estimate: &Estimate<N>,
        covariance: &SMatrix<f64, N, N>,
    ) -> Option<Self> {
        let mut filter = Eskf::new(*params).ok()?;
        filter.adopt::<S, N>(estimate, covariance).ok()?;
        Some(Self::FromKeyframe(filter))
    }

    pub(in crate::navigation::state_estimator) fn time_ns(&self) -> i64 {
        each!(self, filter => filter.estimate().map_or(i64::MIN, |estimate| estimate.time_ns))
    }

    pub(in crate::navigation::state_estimator) fn propagate(
        &mut self,
        sample: &ImuMean,
        is_gap: bool,
    ) -> Result<(), Refusal> {
        each!(self, filter => filter.propagate_part(sample, is_gap))
    }

    pub(in crate::navigation::state_estimator) fn pose(&self) -> Option<Pose> {
        each!(self, filter => Some(Pose::of(filter.estimate()?, filter.covariance())))
    }
}
