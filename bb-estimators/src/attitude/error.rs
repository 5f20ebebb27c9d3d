//! The error of an orientation, and the root mean square over a recording.
//!
//! The decomposition into heading and inclination is the one of D. Laidig, M. Caruso, A. Cereatti, T. Seel,
//! "BROAD – A Benchmark for Robust Inertial Orientation Estimation", Data 6(7):72, 2021.

use nalgebra::{ComplexField, UnitQuaternion};

use super::Real;

/// The angles of the rotation `estimate ⊗ truth⁻¹`, which is in the world frame. All are in `0..=π` rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrientationError {
    /// The whole rotation, `2 acos |w|`, rad.
    pub total: f64,
    /// Part of the rotation about the vertical, `2 atan |z / w|`, rad.
    pub heading: f64,
    /// Part of the rotation about a horizontal axis, `2 acos √(w² + z²)`, rad.
    pub inclination: f64,
}

impl OrientationError {
    /// The error of `estimate` against `truth`, both `world_from_body` with z up.
    ///
    /// `None` if the truth is not finite, for example where a tracking system lost its markers. An estimate that is
    /// not finite gives NaN, so that it is never mistaken for a missing truth.
    pub fn between<T: Real>(estimate: &UnitQuaternion<T>, truth: &UnitQuaternion<T>) -> Option<Self> {
        if !truth.coords.iter().all(|component| component.is_finite()) {
            return None;
        }
        let error = estimate.quaternion() * truth.quaternion().conjugate();
        let [x, y, z, w] = error.coords.into();
        if !(w + x + y + z).is_finite() {
            return Some(Self { total: f64::NAN, heading: f64::NAN, inclination: f64::NAN });
        }
        // The arctangents are the same angles as the arccosines of the definition, and exact near 0.
        Some(Self {
            total: 2.0 * x.hypot(y).hypot(z).atan2(w.abs()).as_f64(),
            heading: 2.0 * z.abs().atan2(w.abs()).as_f64(),
            inclination: 2.0 * x.hypot(y).atan2(w.hypot(z)).as_f64(),
        })
    }
}

/// Root mean squares of [`OrientationError`]s, added one at a time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ErrorStatistics {
    count: u64,
    skipped: u64,
    total: f64,
    heading: f64,
    inclination: f64,
}

impl ErrorStatistics {
    /// Statistics without samples.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds the error of one sample; `None`, a sample without truth, is only counted as skipped.
    pub fn add(&mut self, error: Option<OrientationError>) {
        let Some(error) = error else {
            self.skipped += 1;
            return;
        };
        self.count += 1;
        self.total += error.total * error.total;
        self.heading += error.heading * error.heading;
        self.inclination += error.inclination * error.inclination;
    }

    /// The number of errors.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The number of samples without truth.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    /// The root mean square of each angle, rad. `None` if there is no error yet.
    pub fn rms(&self) -> Option<OrientationError> {
        let rms = |sum: f64| ComplexField::sqrt(sum / self.count as f64);
        (self.count > 0).then(|| OrientationError {
            total: rms(self.total),
            heading: rms(self.heading),
            inclination: rms(self.inclination),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Quaternion, Unit, Vector3};

    fn truth() -> UnitQuaternion<f64> {
        UnitQuaternion::from_euler_angles(0.4, -0.9, 2.5)
    }

    #[test]
    fn a_turn_about_the_vertical_is_heading_alone() {
        let estimate = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -0.3) * truth();
        let error = OrientationError::between(&estimate, &truth()).unwrap();
        assert!((error.total - 0.3).abs() < 1e-14 && (error.heading - 0.3).abs() < 1e-14);
        assert!(error.inclination < 1e-14);
    }

    #[test]
    fn a_turn_about_a_horizontal_axis_is_inclination_alone() {
        let axis = Unit::new_normalize(Vector3::new(1.0, -2.0, 0.0));
        let estimate = UnitQuaternion::from_axis_angle(&axis, 3.0) * truth();
        let error = OrientationError::between(&estimate, &truth()).unwrap();
        assert!((error.total - 3.0).abs() < 1e-14 && (error.inclination - 3.0).abs() < 1e-14);
        assert!(error.heading < 1e-13);
    }

    #[test]
    fn both_signs_of_a_quaternion_are_one_orientation() {
        let estimate = UnitQuaternion::from_euler_angles(0.5, -0.8, 2.0);
        let negated = Unit::new_unchecked(-estimate.into_inner());
        let error = OrientationError::between(&estimate, &truth()).unwrap();
        assert_eq!(Some(error), OrientationError::between(&negated, &truth()));
        // cos(total / 2) = cos(heading / 2) cos(inclination / 2)
        let product = (0.5 * error.heading).cos() * (0.5 * error.inclination).cos();
        assert!(((0.5 * error.total).cos() - product).abs() < 1e-14);
    }

    #[test]
    fn missing_truth_is_skipped_and_a_broken_estimate_is_not() {
        let nan = Unit::new_unchecked(Quaternion::new(f64::NAN, 0.0, 0.0, 0.0));
        let turned = |angle| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle) * truth();
        let mut statistics = ErrorStatistics::new();
        assert_eq!(statistics.rms(), None);
        statistics.add(OrientationError::between(&truth(), &nan));
        assert_eq!((statistics.count(), statistics.skipped(), statistics.rms()), (0, 1, None));
        statistics.add(OrientationError::between(&turned(0.3), &truth()));
        statistics.add(OrientationError::between(&turned(-0.4), &truth()));
        let rms = statistics.rms().unwrap();
        assert!((rms.total - 0.125_f64.sqrt()).abs() < 1e-14);
        assert!((rms.heading - rms.total).abs() < 1e-14 && rms.inclination < 1e-14);
        statistics.add(OrientationError::between(&nan, &truth()));
        assert_eq!(statistics.count(), 3);
        assert!(statistics.rms().unwrap().total.is_nan());
    }
}
