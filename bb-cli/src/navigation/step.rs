//! What a filter says of a keyframe, and how it came there.

use super::measured::Answers;
use bb_core::nalgebra::{Matrix6, UnitQuaternion, Vector3};
use bb_estimators::navigation::Estimate;

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

/// What became of the measurements of each sensor at a keyframe, and why one was refused, in the order of
/// [`Sensor::ALL`](super::measured::Sensor::ALL).
pub(crate) type Taken = [Option<Result<(), String>>; 4];

/// How it went from one keyframe to the next.
#[derive(Clone, Debug, Default)]
pub(crate) struct Step {
    pub(crate) refused: u64,
    /// Samples of the IMU among them, and why the first was.
    pub(crate) samples: (u64, Option<String>),
    /// With the samples for a filter; without for a smoother, whose samples are integrated as they come.
    pub(crate) keyframe_s: f64,
    pub(crate) propagation_s: f64,
    /// Of the heap, at the keyframe.
    pub(crate) allocations: u64,
    /// Innovations, of a filter or smoother that tells them.
    pub(crate) answers: Answers,
    pub(crate) taken: Taken,
}

impl Step {
    /// Notes what a filter or smoother answered.
    pub(crate) fn answer(&mut self, answers: Answers) {
        self.answers = answers;
        self.take(
            answers.map(|answer| answer.map(|answer| answer.map(drop).map_err(|refusal| refusal.to_string()))),
        );
    }

    /// Notes what became of the measurements.
    pub(crate) fn take(&mut self, taken: Taken) {
        self.refused += taken.iter().flatten().map(|taken| u64::from(taken.is_err())).sum::<u64>();
        self.taken = taken;
    }
}
