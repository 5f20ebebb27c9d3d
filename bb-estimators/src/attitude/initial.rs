//! The orientation given by one accelerometer sample and, if there is one, one magnetometer sample.
//!
//! Gravity gives the tilt, the horizontal part of the magnetic field the heading; the vertical part of the
//! field, its dip, is not used.

use core::error::Error;
use core::fmt;

use nalgebra::{UnitQuaternion, Vector3};

use super::Real;
use super::rotation::{turn_heading, turn_upright};
pub use super::sample::FREE_FALL;
use super::sample::Quantity;

/// The smallest horizontal part of the magnetic field, as a fraction of its norm, that gives a heading: a dip of
/// 89.4°, which occurs only near the magnetic poles.
pub const MIN_HORIZONTAL_FRACTION: f64 = 0.01;

/// Reason for which two vectors give no orientation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InitialError {
    /// A component is NaN or infinite.
    NonFinite {
        /// The quantity.
        quantity: Quantity,
    },
    /// The specific force is below [`FREE_FALL`], so it does not show which way is up.
    FreeFall,
    /// The magnetic field is zero or vertical within [`MIN_HORIZONTAL_FRACTION`], so it shows no heading.
    NoHorizontalField,
}

impl fmt::Display for InitialError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NonFinite { quantity } => write!(f, "{quantity} is not finite"),
            Self::FreeFall => {
                write!(f, "specific force is below {FREE_FALL} m/s²: it does not show where up is")
            }
            Self::NoHorizontalField => {
                f.write_str("magnetic field has no horizontal part: it does not show a heading")
            }
        }
    }
}

impl Error for InitialError {}

/// The orientation `world_from_body` in ENU given by a sensor at rest.
///
/// `specific_force` (m/s²) and `magnetic_field` (any unit) are in the body frame. With a field, the body's
/// heading is such that the horizontal field points along y, magnetic north. Without one, the result is the
/// shortest rotation that brings the specific force upright: its heading error against no rotation, as
/// [`OrientationError`](super::OrientationError) measures it, is 0. A body exactly upside down is turned
/// about its x axis.
///
/// # Errors
///
/// [`InitialError`] if a value is not finite, in free fall, or if there is a field that shows no heading.
pub fn initial_orientation<T: Real>(
    specific_force: &Vector3<T>,
    magnetic_field: Option<&Vector3<T>>,
) -> Result<UnitQuaternion<T>, InitialError> {
    if !specific_force.iter().all(|component| component.is_finite()) {
        return Err(InitialError::NonFinite { quantity: Quantity::SpecificForce });
    }
    let up = scaled_direction(specific_force, T::of(FREE_FALL)).ok_or(InitialError::FreeFall)?;
    let level = turn_upright(&UnitQuaternion::identity(), &up);
    let Some(field) = magnetic_field else {
        return Ok(level);
    };
    if !field.iter().all(|component| component.is_finite()) {
        return Err(InitialError::NonFinite { quantity: Quantity::MagneticField });
    }
    let field = scaled_direction(field, T::ZERO).ok_or(InitialError::NoHorizontalField)?;
    let error = heading_error(&(level * field)).ok_or(InitialError::NoHorizontalField)?;
    Ok(turn_heading(&level, error))
}

/// The angle, rad, about the world's vertical that brings the horizontal part of the unit vector `field`, in the
/// world frame, to y. `None` if it has no horizontal part.
pub(super) fn heading_error<T: Real>(field: &Vector3<T>) -> Option<T> {
    let squared = field.x * field.x + field.y * field.y;
    (squared > T::of(MIN_HORIZONTAL_FRACTION * MIN_HORIZONTAL_FRACTION)).then(|| field.x.atan2(field.y))
}

/// The unit vector along a finite `vector` of any size, or `None` if its norm is at most `least`.
fn scaled_direction<T: Real>(vector: &Vector3<T>, least: T) -> Option<Vector3<T>> {
    let largest = vector.amax();
    if largest == T::ZERO {
        return None;
    }
    // Twice, because the reciprocal of a subnormal is infinite and its quotient inexact.
    let scaled = (vector / largest).normalize();
    (vector.dot(&scaled) > least).then_some(scaled)
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::PI;

    const UP: Vector3<f64> = Vector3::new(0.0, 0.0, 9.81);
    const FIELD: Vector3<f64> = Vector3::new(0.0, 20e-6, -45e-6);

    #[test]
    fn level_and_facing_north_is_no_rotation() {
        let orientation = initial_orientation(&UP, Some(&FIELD)).unwrap();
        assert!(orientation.angle() < 1e-15);
    }

    #[test]
    fn every_orientation_is_found_again() {
        for (roll, pitch, yaw) in [(0.1, 0.2, 0.3), (-3.0, 1.5, -2.0), (PI - 1e-6, 0.0, 1.0), (0.0, 0.5 * PI, 3.0)]
        {
            let truth = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
            let body_from_world = truth.inverse();
            let found = initial_orientation(&(body_from_world * UP), Some(&(body_from_world * FIELD))).unwrap();
            assert!(found.angle_to(&truth) < 1e-10, "{roll} {pitch} {yaw}: {}", found.angle_to(&truth));
        }
    }

    #[test]
    fn without_a_field_the_rotation_is_the_shortest() {
        let found = initial_orientation(&Vector3::new(9.81, 0.0, 0.0), None).unwrap();
        assert!((found * Vector3::x() - Vector3::z()).norm() < 1e-15);
        assert!((found.angle() - core::f64::consts::FRAC_PI_2).abs() < 1e-15);
        assert_eq!(found.k, 0.0);
    }

    #[test]
    fn upside_down_is_exact_and_next_to_it_too() {
        for x in [0.0, 1e-300, 1e-17, 1e-12, 1e-6] {
            let force = Vector3::new(x, 0.0, -9.81);
            let found = initial_orientation(&force, None).unwrap();
            assert!((found * force.normalize() - Vector3::z()).norm() < 1e-14, "{x}");
        }
    }

    #[test]
    fn the_size_of_the_vectors_does_not_matter() {
        let force = Vector3::new(1.0, 2.0, 3.0);
        let field = Vector3::new(-1.0, 1.0, 0.5);
        let found = initial_orientation(&force, Some(&field)).unwrap();
        for scale in [1e-300_f64, 1e-160, 1e-6, 1e160, 1e300] {
            let scaled = initial_orientation(&(force * scale.max(1.0)), Some(&(field * scale))).unwrap();
            assert!(scaled.angle_to(&found) < 1e-14, "{scale}");
        }
    }

    #[test]
    fn degenerate_vectors_are_errors() {
        let zero = Vector3::zeros();
        let nan = Vector3::new(0.0, f64::NAN, 1.0);
        let infinite = Vector3::new(0.0, f64::INFINITY, 1.0);
        assert_eq!(initial_orientation(&zero, None), Err(InitialError::FreeFall));
        assert_eq!(initial_orientation(&(UP * 0.01), None), Err(InitialError::FreeFall));
        assert_eq!(initial_orientation(&UP, Some(&zero)), Err(InitialError::NoHorizontalField));
        assert_eq!(initial_orientation(&UP, Some(&-UP)), Err(InitialError::NoHorizontalField));
        for bad in [nan, infinite] {
            let quantity = Quantity::SpecificForce;
            assert_eq!(initial_orientation(&bad, None), Err(InitialError::NonFinite { quantity }));
            let quantity = Quantity::MagneticField;
            assert_eq!(initial_orientation(&UP, Some(&bad)), Err(InitialError::NonFinite { quantity }));
        }
    }
}
