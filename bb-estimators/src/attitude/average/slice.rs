//! The average of any number of orientations.

use core::cmp::Ordering;

use nalgebra::{Matrix4, Quaternion, SymmetricEigen, Unit, UnitQuaternion};

use super::{AverageError, check};
use crate::attitude::Real;

/// Relative difference of M's two largest eigenvalues below which the average is undefined.
const AMBIGUOUS: f64 = 1e-12;

/// The average of orientations with weights, which need not add up to 1.
///
/// For inputs `world_from_body`, the result is one too, on the same half of the unit sphere as the one with the
/// largest weight. For two orientations, [`average_pair`](super::average_pair) is faster, with the same result. Does
/// not allocate.
///
/// # Errors
///
/// [`AverageError`] if a weight or an orientation is not valid, if there is no weight above 0, or if two
/// averages are equally good.
///
/// # Method
///
/// The eigenvector of the greatest eigenvalue of `M = Σ wᵢ qᵢ qᵢᵀ`, by the symmetric QR algorithm.
pub fn average<T: Real>(weighted: &[(UnitQuaternion<T>, T)]) -> Result<UnitQuaternion<T>, AverageError> {
    for (index, (orientation, weight)) in weighted.iter().enumerate() {
        check(index, orientation, weight.as_f64())?;
    }
    let by_weight = weighted.iter().max_by(|a, b| a.1.partial_cmp(&b.1).unwrap_or(Ordering::Equal));
    let (heaviest, greatest) = by_weight.filter(|(_, weight)| *weight > T::ZERO).ok_or(AverageError::NoWeight)?;

    let mut moments = Matrix4::zeros();
    for (orientation, weight) in weighted {
        let q = &orientation.coords;
        moments += q * q.transpose() * (*weight / *greatest);
    }
    let eigen = SymmetricEigen::new(moments);
    let largest = eigen.eigenvalues.imax();
    let gap = (0..4)
        .filter(|&index| index != largest)
        .map(|index| eigen.eigenvalues[largest] - eigen.eigenvalues[index])
        .fold(T::of(f64::INFINITY), T::min);
    if gap < T::above_rounding(AMBIGUOUS) * moments.trace() {
        return Err(AverageError::Ambiguous);
    }

    let average = eigen.eigenvectors.column(largest).into_owned();
    let sign = if average.dot(&heaviest.coords) < T::ZERO { -T::ONE } else { T::ONE };
    Ok(Unit::new_normalize(Quaternion::from(average * sign)))
}
