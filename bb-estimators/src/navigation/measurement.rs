//! Measurement models, each with a residual, a Jacobian and a noise covariance.
//!
//! Each kind of measurement is a type that implements [`Measurement`]. You can add your own:
//!
//! ```
//! use bb_estimators::navigation::{Estimate, Linearised, Measurement, POSITION, Refusal, States};
//! use nalgebra::Vector3;
//!
//! /// Distance to a beacon.
//! struct Range {
//!     beacon: Vector3<f64>,
//!     distance_m: f64,
//!     deviation_m: f64,
//! }
//!
//! impl Measurement<1> for Range {
//!     fn linearise<S: States, const N: usize>(
//!         &self,
//!         at: &Estimate<N>,
//!         model: &mut Linearised<1, N>,
//!     ) -> Result<(), Refusal> {
//!         let offset = at.position - self.beacon;
//!         let direction = offset.try_normalize(1e-3).ok_or(Refusal::NotObservable)?;
//!         model.residual[0] = self.distance_m - offset.norm();
//!         model.set_row(0, POSITION, &direction);
//!         model.noise[(0, 0)] = self.deviation_m * self.deviation_m;
//!         Ok(())
//!     }
//! }
//! ```

mod gnss;
mod height;
mod magnetic;
mod pose;
mod relative;
mod rest;
mod wheels;

pub use gnss::{GnssHeading, GnssPosition, GnssVelocity};
pub use height::{BarometricHeight, Height};
pub use magnetic::{MagneticField, MagneticHeading};
pub use pose::AbsolutePose;
pub use relative::RelativePose;
pub use rest::{ZeroRotation, ZeroVelocity};
pub use wheels::{BodyVelocity, NonHolonomic, WheelSpeed};

use nalgebra::{Matrix3, SMatrix, Vector3};

use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, States};

/// A measurement with `D` components.
pub trait Measurement<const D: usize> {
    /// Compares the measurement with the prediction from the estimate.
    ///
    /// # Errors
    ///
    /// Returns the reason why this is impossible: [`Refusal::NotObservable`] if the measurement carries no information in this
    /// state, or [`Refusal::NoKeyframe`].
    fn linearise<S: States, const N: usize>(
        &self,
        at: &Estimate<N>,
        model: &mut Linearised<D, N>,
    ) -> Result<(), Refusal>;
}

/// A measurement linearised at an estimate: `residual = H error + noise`. All zero initially.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Linearised<const D: usize, const N: usize> {
    /// The measured value minus the predicted value.
    pub residual: [f64; D],
    /// H, row by row: the derivative of the residual with respect to each error. Columns are those of the error vector.
    pub jacobian: [[f64; N]; D],
    /// Covariance of the noise.
    pub noise: SMatrix<f64, D, D>,
}

impl<const D: usize, const N: usize> Linearised<D, N> {
    pub(crate) fn new() -> Self {
        Self { residual: [0.0; D], jacobian: [[0.0; N]; D], noise: SMatrix::zeros() }
    }

    /// Sets the derivative of one component with respect to three errors, from `error` on.
    #[inline]
    pub fn set_row(&mut self, row: usize, error: usize, derivative: &Vector3<f64>) {
        for k in 0..3 {
            self.jacobian[row][error + k] = derivative[k];
        }
    }

    /// Sets the derivative of three components, from `row` on, with respect to three errors, from `error` on.
    #[inline]
    pub fn set_block(&mut self, row: usize, error: usize, derivative: &Matrix3<f64>) {
        for i in 0..3 {
            for k in 0..3 {
                self.jacobian[row + i][error + k] = derivative[(i, k)];
            }
        }
    }

    /// Sets the derivative of three components, from `row` on, with respect to one error.
    #[inline]
    pub fn set_column(&mut self, row: usize, error: usize, derivative: &Vector3<f64>) {
        for i in 0..3 {
            self.jacobian[row + i][error] = derivative[i];
        }
    }

    /// Sets three components of the residual, from `row` on.
    #[inline]
    pub fn set_residual(&mut self, row: usize, residual: &Vector3<f64>) {
        for i in 0..3 {
            self.residual[row + i] = residual[i];
        }
    }

    /// Sets the noise of three components, from `row` on; they are uncorrelated with the others.
    #[inline]
    pub fn set_noise(&mut self, row: usize, covariance: &Matrix3<f64>) {
        self.noise.fixed_view_mut::<3, 3>(row, row).copy_from(covariance);
    }
}

/// Covariance of isotropic noise.
#[inline]
pub(in crate::navigation) fn isotropic(deviation: f64) -> Matrix3<f64> {
    Matrix3::identity() * (deviation * deviation)
}
