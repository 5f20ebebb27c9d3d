//! Covariances in ROS's format: row by row; all zeros if unknown.

use nalgebra::SMatrix;

/// Row by row; all zeros if unknown.
pub(super) fn to_ros<const N: usize, const ELEMENTS: usize>(
    covariance: &Option<SMatrix<f64, N, N>>,
) -> [f64; ELEMENTS] {
    covariance.as_ref().map_or([0.0; ELEMENTS], rows)
}

/// `None` if all are zero. A negative zero counts as a known value.
pub(super) fn from_ros<const N: usize, const ELEMENTS: usize>(
    elements: &[f64; ELEMENTS],
) -> Option<SMatrix<f64, N, N>> {
    let is_known = elements.iter().any(|element| element.to_bits() != 0);
    is_known.then(|| matrix(elements))
}

/// Row by row.
pub(super) fn rows<const N: usize, const ELEMENTS: usize>(matrix: &SMatrix<f64, N, N>) -> [f64; ELEMENTS] {
    let mut elements = [0.0; ELEMENTS];
    // nalgebra iterates column by column.
    elements.iter_mut().zip(matrix.transpose().iter()).for_each(|(element, value)| *element = *value);
    elements
}

/// The matrix with these rows.
pub(super) fn matrix<const N: usize, const ELEMENTS: usize>(elements: &[f64; ELEMENTS]) -> SMatrix<f64, N, N> {
    SMatrix::from_row_iterator(elements.iter().copied())
}
