//! A factor, linearised and divided by its noise.

use nalgebra::SMatrix;

use super::matrix::is_sound;
use crate::navigation::math::{ln, sqrt};
use crate::navigation::measurement::{Linearised, Measurement};
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, States};

/// The most numbers that one factor compares.
pub const MOST_ROWS: usize = 9;

/// A factor, linearised and divided by its noise: `residual = H_previous error_previous + H error + noise` with noise of
/// variance 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rows<const N: usize> {
    pub(super) count: usize,
    pub(super) residual: [f64; MOST_ROWS],
    pub(super) previous: [[f64; N]; MOST_ROWS],
    pub(super) at: [[f64; N]; MOST_ROWS],
    /// `-½ ln det R` of the noise R.
    pub(super) log_density: f64,
}

impl<const N: usize> Rows<N> {
    /// None yet.
    pub fn new() -> Self {
        let zeros = [[0.0; N]; MOST_ROWS];
        Self { count: 0, residual: [0.0; MOST_ROWS], previous: zeros, at: zeros, log_density: 0.0 }
    }

    /// Sets what was measured less what was expected, what it grows by with the errors at the keyframe before and at the
    /// keyframe, row by row, and the covariance of the noise.
    ///
    /// # Errors
    ///
    /// [`Refusal::Noise`] if the covariance is not positive definite, [`Refusal::NonFinite`] and [`Refusal::OutOfRange`] for
    /// numbers that are NaN or absurdly large.
    pub fn set<const D: usize>(
        &mut self,
        residual: [f64; D],
        previous: Option<&[[f64; N]; D]>,
        at: &[[f64; N]; D],
        noise: &SMatrix<f64, D, D>,
    ) -> Result<(), Refusal> {
        const { assert!(D <= MOST_ROWS, "a factor has at most `MOST_ROWS` rows") };
        self.count = D;
        self.residual[..D].copy_from_slice(&residual);
        self.at[..D].copy_from_slice(at);
        match previous {
            Some(previous) => self.previous[..D].copy_from_slice(previous),
            None => self.previous[..D].fill([0.0; N]),
        }
        self.log_density = 0.0;
        // Forward substitution with the Cholesky factor of the noise, as it is found.
        let mut lower = *noise;
        for i in 0..D {
            for j in 0..i {
                let mut factor = lower[(i, j)];
                for k in 0..j {
                    factor -= lower[(i, k)] * lower[(j, k)];
                }
                factor *= lower[(j, j)];
                lower[(i, j)] = factor;
                lower[(i, i)] -= factor * factor;
                if factor != 0.0 {
                    self.subtract(i, j, factor);
                }
            }
            if lower[(i, i)].is_nan() {
                return Err(Refusal::NonFinite);
            }
            if lower[(i, i)] <= 0.0 {
                return Err(Refusal::Noise);
            }
            // What is left is the reciprocal of the diagonal.
            self.log_density -= 0.5 * ln(lower[(i, i)]);
            lower[(i, i)] = 1.0 / sqrt(lower[(i, i)]);
            self.scale(i, lower[(i, i)]);
        }
        let mut rows = self.at[..D].iter().chain(&self.previous[..D]);
        if rows.all(|row| is_sound(row)) && is_sound(&self.residual[..D]) {
            return Ok(());
        }
        let mut numbers = self.at[..D].iter().chain(&self.previous[..D]).flatten().chain(&self.residual[..D]);
        let is_number = numbers.all(|x| x.is_finite());
        Err(if is_number { Refusal::OutOfRange } else { Refusal::NonFinite })
    }

    /// Sets them from a measurement at the keyframe.
    ///
    /// # Errors
    ///
    /// As the measurement, and as [`set`](Self::set).
    pub fn measure<S: States, M: Measurement<D>, const D: usize>(
        &mut self,
        measurement: &M,
        at: &Estimate<N>,
    ) -> Result<(), Refusal> {
        let mut model = Linearised::<D, N>::new();
        measurement.linearise::<S, N>(at, &mut model)?;
        self.set(model.residual, None, &model.jacobian, &model.noise)
    }

    /// Multiplies the weight: the square of what the rows are multiplied by.
    pub(super) fn weigh(&mut self, weight: f64) {
        let factor = sqrt(weight);
        (0..self.count).for_each(|row| self.scale(row, factor));
    }

    #[inline]
    fn scale(&mut self, row: usize, factor: f64) {
        self.residual[row] *= factor;
        for j in 0..N {
            self.at[row][j] *= factor;
            self.previous[row][j] *= factor;
        }
    }

    #[inline]
    fn subtract(&mut self, from: usize, row: usize, factor: f64) {
        self.residual[from] -= factor * self.residual[row];
        for j in 0..N {
            self.at[from][j] -= factor * self.at[row][j];
            self.previous[from][j] -= factor * self.previous[row][j];
        }
    }
}

impl<const N: usize> Default for Rows<N> {
    fn default() -> Self {
        Self::new()
    }
}
