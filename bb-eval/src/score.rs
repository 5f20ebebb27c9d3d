//! The error of one run: which samples count, and the root mean square over them.

use bb_core::nalgebra::UnitQuaternion;
use bb_estimators::attitude::{ErrorStatistics, OrientationError};
#[cfg(feature = "recordings")]
use bb_mcap::Truth;

/// The errors of an estimate against the truth, collected one sample at a time.
///
/// A sample counts while the body moves and where the truth is known at its stamp, as in D. Laidig, M. Caruso,
/// A. Cereatti, T. Seel, "BROAD – A Benchmark for Robust Inertial Orientation Estimation", Data 6(7):72, 2021. Nothing
/// is aligned: estimate and truth are both `world_from_body` in ENU.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Score {
    statistics: ErrorStatistics,
}

/// Root mean squares of the three angles defined by [`OrientationError`], degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Degrees {
    /// The whole rotation.
    pub total: f64,
    /// Part of the rotation about the vertical.
    pub heading: f64,
    /// Part of the rotation about a horizontal axis.
    pub inclination: f64,
}

impl Score {
    /// Adds an estimate at a time in nanoseconds, compared with the truth of a recording. Returns the error if the
    /// truth is known, whether or not the sample counts.
    #[cfg(feature = "recordings")]
    pub fn add_at(
        &mut self,
        truth: &Truth,
        time_ns: i64,
        estimate: &UnitQuaternion<f64>,
    ) -> Option<OrientationError> {
        let (truth, moving) = truth.at(time_ns);
        self.add(estimate, truth.as_ref(), moving)
    }

    /// Adds an estimate compared with a truth from elsewhere, `None` if it is unknown.
    pub fn add(
        &mut self,
        estimate: &UnitQuaternion<f64>,
        truth: Option<&UnitQuaternion<f64>>,
        moving: bool,
    ) -> Option<OrientationError> {
        let error = truth.and_then(|truth| OrientationError::between(estimate, truth));
        if moving {
            self.statistics.add(error);
        }
        error
    }

    /// The number of counted samples.
    pub fn count(&self) -> u64 {
        self.statistics.count()
    }

    /// The root mean squares; `None` if no sample counted.
    pub fn rms(&self) -> Option<Degrees> {
        self.statistics.rms().map(|OrientationError { total, heading, inclination }| Degrees {
            total: total.to_degrees(),
            heading: heading.to_degrees(),
            inclination: inclination.to_degrees(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bb_core::nalgebra::Vector3;

    #[test]
    fn only_motion_with_truth_counts() {
        let truth = UnitQuaternion::from_euler_angles(0.3, 0.2, -1.0);
        let turned = |angle| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle) * truth;
        let mut score = Score::default();
        assert_eq!(score.add(&turned(0.1), None, true), None);
        assert!(score.add(&turned(1.0), Some(&truth), false).is_some());
        assert_eq!((score.count(), score.rms()), (0, None));
        let _error = score.add(&turned(0.1), Some(&truth), true);
        let rms = score.rms().expect("one counts");
        assert_eq!(score.count(), 1);
        assert!((rms.total - 0.1_f64.to_degrees()).abs() < 1e-12 && rms.inclination < 1e-12);
    }
}
