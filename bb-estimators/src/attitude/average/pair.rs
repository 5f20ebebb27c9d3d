//! The average of two orientations, in closed form.

use nalgebra::{Unit, UnitQuaternion};

use super::{AverageError, check};
use crate::attitude::Real;

/// Relative difference of M's two eigenvalues below which the average is undefined.
const AMBIGUOUS: f64 = 1e-12;

/// The average of two orientations with weights, which need not add up to 1.
///
/// The average is on the shorter arc between the two. With equal weights it is halfway, as by slerp, and
/// with one weight 0 it is the other orientation. Otherwise it is closer to the heavier one than slerp at
/// `w₂/(w₁ + w₂)`, to which it tends for small angles. For inputs `world_from_body` the result is one, too.
///
/// # Errors
///
/// [`AverageError`] if a weight or an orientation is not valid, if both weights are 0, or if the two are 180°
/// apart with equal weights.
///
/// # Method
///
/// The paper's closed form for two quaternions is the dominant eigenvector of M in the plane that they span.
/// Here the plane's axes are the half sum and the half difference of `q₁` and `±q₂`, the sign that makes their
/// product positive. With 4α the angle between the orientations M is
/// `[(w₁+w₂) cos²α, (w₁-w₂) sin α cos α; ·, (w₁+w₂) sin²α]`, whose dominant eigenvector is at φ with
/// `tan 2φ = (w₁-w₂) sin 2α / ((w₁+w₂) cos 2α)`. The same vector, without the cancellation of the paper's
/// `w₁ - w₂ + z`.
pub fn average_pair<T: Real>(
    first: &UnitQuaternion<T>,
    first_weight: T,
    second: &UnitQuaternion<T>,
    second_weight: T,
) -> Result<UnitQuaternion<T>, AverageError> {
    check(0, first, first_weight.as_f64())?;
    check(1, second, second_weight.as_f64())?;
    let greatest = first_weight.max(second_weight);
    if greatest == T::ZERO {
        return Err(AverageError::NoWeight);
    }
    let (w1, w2) = (first_weight / greatest, second_weight / greatest);

    let q1 = first.into_inner();
    let q2 = if first.coords.dot(&second.coords) < T::ZERO { -second.into_inner() } else { second.into_inner() };
    let (sum, difference) = ((q1 + q2) * T::HALF, (q1 - q2) * T::HALF);
    let (cos, sin) = (sum.norm(), difference.norm());

    let across = (w1 - w2) * (T::TWO * sin * cos);
    let along = (w1 + w2) * (cos - sin) * (cos + sin);
    if across.hypot(along) < T::above_rounding(AMBIGUOUS) * (w1 + w2) {
        return Err(AverageError::Ambiguous);
    }
    let phi = T::HALF * across.atan2(along);
    // sin φ / sin α, and its limit where the two orientations are one.
    let ratio = if sin > T::ZERO { phi.sin() / sin } else { T::ZERO };
    Ok(Unit::new_normalize(sum * (phi.cos() / cos) + difference * ratio))
}
