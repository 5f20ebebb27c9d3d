//! Covariances as ROS has them: row by row; all zeros if unknown.

use nalgebra::SMatrix;

/// Row by row; all zeros if unknown.
pub(super) fn to_ros<const N: usize, const ELEMENTS: usize>(
    covariance: &Option<SMatrix<f64, N, N>>,
) -> [f64; ELEMENTS] {
    let mut elements = [0.0; ELEMENTS];
    if let Some(covariance) = covariance {
        // nalgebra goes column by column.
        elements.iter_mut().zip(covariance.transpose().iter()).for_each(|(element, value)| *element = *value);
    }
    elements
}

/// None if all are zero. A negative zero is no mark: whoever measured it wrote it.
pub(super) fn from_ros<const N: usize, const ELEMENTS: usize>(
    elements: &[f64; ELEMENTS],
) -> Option<SMatrix<f64, N, N>> {
    let is_known = elements.iter().any(|element| element.to_bits() != 0);
    is_known.then(|| SMatrix::from_row_iterator(elements.iter().copied()))
}
