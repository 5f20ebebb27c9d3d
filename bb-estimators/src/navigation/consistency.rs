//! Consistency of a filter's errors with its covariance: NIS, whiteness of innovations, NEES.
//!
//! Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to Tracking and Navigation", 2001,
//! section 5.4.

use nalgebra::{SMatrix, SVector};

use crate::navigation::fused::Fused;
use crate::navigation::math::sqrt;

/// Innovation statistics of one sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Consistency {
    count: u64,
    dimensions: u64,
    nis: f64,
    squares: f64,
    products: f64,
    previous: Option<f64>,
}

impl Consistency {
    #[inline]
    pub(crate) fn add(&mut self, fused: &Fused) {
        self.count += 1;
        self.dimensions += fused.dimension as u64;
        self.nis += fused.nis;
        self.squares += fused.whitened * fused.whitened;
        if let Some(previous) = self.previous {
            self.products += previous * fused.whitened;
        }
        self.previous = Some(fused.whitened);
    }

    /// The number of measurements fused.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Mean normalised innovation squared, divided by the dimension: 1 if the filter is consistent, larger if it is
    /// overconfident. `None` before the first measurement.
    pub fn mean_nis(&self) -> Option<f64> {
        (self.dimensions > 0).then(|| self.nis / self.dimensions as f64)
    }

    /// Correlation between the first components of successive innovations: 0 if innovations are white, up to 2/√n by chance.
    /// `None` before the second measurement.
    pub fn correlation(&self) -> Option<f64> {
        (self.count > 1 && self.squares > 0.0).then(|| self.products / self.squares)
    }

    /// The bounds within which the [`mean_nis`](Self::mean_nis) of a consistent filter stays about 95 % of the time.
    pub fn nis_bounds(&self) -> (f64, f64) {
        // The variance of χ² with n degrees of freedom is 2 n.
        let spread = 1.96 * sqrt(2.0 / (self.dimensions.max(1)) as f64);
        ((1.0 - spread).max(0.0), 1.0 + spread)
    }
}

/// Normalised estimation error squared, `eᵀ P⁻¹ e`: its mean is `D` if the filter is consistent. `None` if `P` is not positive
/// definite.
pub fn nees<const D: usize>(error: &SVector<f64, D>, covariance: &SMatrix<f64, D, D>) -> Option<f64> {
    let decomposed = nalgebra::linalg::Cholesky::new(*covariance)?;
    Some(error.dot(&decomposed.solve(error)))
}
