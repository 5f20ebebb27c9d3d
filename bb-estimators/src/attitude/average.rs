//! The weighted average of orientations.
//!
//! F. L. Markley, Y. Cheng, J. L. Crassidis, Y. Oshman, "Averaging Quaternions", Journal of Guidance,
//! Control, and Dynamics 30(4), 2007: the average is the unit quaternion that maximises `qᵀ M q` with
//! `M = Σ wᵢ qᵢ qᵢᵀ`, the eigenvector of M's greatest eigenvalue. It is the least-squares average of the
//! rotation matrices, and the signs of the quaternions do not matter to it.

#[cfg(feature = "runtime")]
mod estimator;
mod pair;
mod slice;
#[cfg(test)]
mod tests;

use core::error::Error;
use core::fmt;

use nalgebra::UnitQuaternion;

use crate::attitude::Real;

#[cfg(feature = "runtime")]
pub use estimator::{OrientationAverage, OrientationAverageOptions, OrientationPair};
pub use pair::average_pair;
pub use slice::average;

/// Reason for which orientations have no average.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AverageError {
    /// A weight is negative, NaN or infinite.
    InvalidWeight {
        /// The position of the orientation with that weight.
        index: usize,
        /// The weight.
        weight: f64,
    },
    /// Absence of orientations, or weights that are all 0.
    NoWeight,
    /// An orientation is not finite.
    NonFinite {
        /// Position of that orientation.
        index: usize,
    },
    /// Two averages are equally good, as between two orientations of equal weight that are 180° apart.
    Ambiguous,
}

impl fmt::Display for AverageError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::InvalidWeight { index, weight } => {
                write!(f, "weight {index} is {weight}: weights are finite and not negative")
            }
            Self::NoWeight => f.write_str("no orientation has a weight above 0"),
            Self::NonFinite { index } => write!(f, "orientation {index} is not finite"),
            Self::Ambiguous => f.write_str("orientations are opposite: two averages are equally good"),
        }
    }
}

impl Error for AverageError {}

/// Accepts one orientation and its weight.
fn check<T: Real>(index: usize, orientation: &UnitQuaternion<T>, weight: f64) -> Result<(), AverageError> {
    if !(weight.is_finite() && weight >= 0.0) {
        return Err(AverageError::InvalidWeight { index, weight });
    }
    if !orientation.coords.iter().all(|component| component.is_finite()) {
        return Err(AverageError::NonFinite { index });
    }
    Ok(())
}
