//! What a filter says of a keyframe, and how it came there.

use super::measured::Answers;
use bb_core::nalgebra::{Matrix6, UnitQuaternion, Vector3};
use bb_estimators::navigation::{Estimate, Refusal};

/// What a filter says of a keyframe.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Known {
    pub(crate) position: Vector3<f64>,
    pub(crate) velocity: Vector3<f64>,
    pub(crate) world_from_body: UnitQuaternion<f64>,
    /// Position error, then rotation error, both in the world.
    pub(crate) covariance: Matrix6<f64>,
}

impl Known {
    pub(crate) fn of<const N: usize>(estimate: &Estimate<N>, covariance: Matrix6<f64>) -> Self {
        let Estimate { position, velocity, world_from_body, .. } = *estimate;
        Self { position, velocity, world_from_body, covariance }
    }
}

/// How it went from one keyframe to the next.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Step {
    pub(crate) refused: u64,
    /// Samples of the IMU among them, and why the first was.
    pub(crate) samples: (u64, Option<Refusal>),
    /// With the samples for a filter; without for a smoother, whose samples are integrated as they come.
    pub(crate) keyframe_s: f64,
    pub(crate) propagation_s: f64,
    /// Of the heap, at the keyframe.
    pub(crate) allocations: u64,
    pub(crate) answers: Answers,
}
