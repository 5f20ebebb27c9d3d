//! The estimate at a keyframe, and how it was reached.

use super::measured::Answers;
use bb_core::nalgebra::{Matrix6, UnitQuaternion, Vector3};
use bb_estimators::navigation::{Estimate, Refusal};

/// The estimate at a keyframe.
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

/// The results of each sensor's measurements at a keyframe, with the reason for a refusal, in the order of
/// [`Sensor::ALL`](super::measured::Sensor::ALL).
pub(crate) type Taken = [Option<Result<(), String>>; 4];

/// The observations of landmarks at a keyframe: how many, how many refused, and why the first was.
#[derive(Clone, Debug, Default)]
pub(crate) struct Observed {
    pub(crate) all: u64,
    pub(crate) refused: u64,
    pub(crate) first: Option<Refusal>,
}

/// The step from one keyframe to the next.
#[derive(Clone, Debug, Default)]
pub(crate) struct Step {
    pub(crate) refused: u64,
    /// The number of refused IMU samples, and why the first was.
    pub(crate) samples: (u64, Option<String>),
    pub(crate) landmarks: Observed,
    /// Includes the samples for a filter; not for a smoother, whose samples are integrated as they arrive.
    pub(crate) keyframe_s: f64,
    pub(crate) propagation_s: f64,
    /// Of the heap, at the keyframe.
    pub(crate) allocations: Option<u64>,
    /// Innovations, if the filter or smoother reports them.
    pub(crate) answers: Answers,
    pub(crate) taken: Taken,
}

impl Step {
    /// Records the answers of a filter or smoother.
    pub(crate) fn answer(&mut self, answers: Answers) {
        self.answers = answers;
        self.take(
            answers.map(|answer| answer.map(|answer| answer.map(drop).map_err(|refusal| refusal.to_string()))),
        );
    }

    /// Records the results of the observations of landmarks.
    pub(crate) fn observe(&mut self, observed: Observed) {
        self.refused += observed.refused;
        self.landmarks = observed;
    }

    /// Records the results of the measurements.
    pub(crate) fn take(&mut self, taken: Taken) {
        self.refused += taken.iter().flatten().map(|taken| u64::from(taken.is_err())).sum::<u64>();
        self.taken = taken;
    }
}
