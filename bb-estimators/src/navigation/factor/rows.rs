//! A linearised factor, whitened by its noise.

use nalgebra::SMatrix;

use crate::navigation::math::{ln, sqrt};
use crate::navigation::measurement::{Linearised, Measurement};
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, States};

/// The maximum number of values in one factor.
pub(in crate::navigation) const MOST_ROWS: usize = 9;

/// A linearised factor, whitened by its noise: `residual = H_previous error_previous + H error + noise` with noise of
/// variance 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rows<const N: usize> {
    /// Number of rows. Zero unless [`set`](Self::set) has succeeded.
    pub(in crate::navigation) count: usize,
    /// `true` if the rows involve the previous keyframe.
    is_pair: bool,
    pub(in crate::navigation) residual: [f64; MOST_ROWS],
    pub(in crate::navigation) previous: [[f64; N]; MOST_ROWS],
    pub(in crate::navigation) at: [[f64; N]; MOST_ROWS],
    /// `-½ ln det R` of the noise R.
    pub(in crate::navigation) log_density: f64,
}

impl<const N: usize> Rows<N> {
    /// Creates an empty factor.
    pub fn new() -> Self {
        let zeros = [[0.0; N]; MOST_ROWS];
        Self { count: 0, is_pair: false, residual: [0.0; MOST_ROWS], previous: zeros, at: zeros, log_density: 0.0 }
    }

    /// Lets a factor set them, in place of whatever they were before; `has_previous` if it names the previous keyframe.
    pub(in crate::navigation) fn fill(
        &mut self,
        has_previous: bool,
        linearise: impl FnOnce(&mut Self) -> Result<(), Refusal>,
    ) -> Result<(), Refusal> {
        self.count = 0;
        linearise(self)?;
        // A factor may have ignored that `set` refused its numbers, or may involve a keyframe that it did not name.
        if self.count == 0 || (self.is_pair && !has_previous) {
            return Err(Refusal::NotObservable);
        }
        Ok(())
    }

    /// Sets the residual (measured minus expected), its Jacobians with respect to the errors at the previous keyframe
    /// and at this one, row by row, and the covariance of the noise.
    ///
    /// # Errors
    ///
    /// [`Refusal::Noise`] if the covariance is not positive definite; [`Refusal::NonFinite`] and
    /// [`Refusal::OutOfRange`] for numbers that are NaN or absurdly large.
    pub fn set<const D: usize>(
        &mut self,
        residual: [f64; D],
        previous: Option<&[[f64; N]; D]>,
        at: &[[f64; N]; D],
        noise: &SMatrix<f64, D, D>,
    ) -> Result<(), Refusal> {
        const { assert!(D <= MOST_ROWS, "a factor has at most `MOST_ROWS` rows") };
        self.count = 0;
        self.is_pair = previous.is_some();
        self.residual[..D].copy_from_slice(&residual);
        self.at[..D].copy_from_slice(at);
        match previous {
            Some(previous) => self.previous[..D].copy_from_slice(previous),
            None => self.previous[..D].fill([0.0; N]),
        }
        self.log_density = 0.0;
        // Forward substitution with the Cholesky factor of the noise while it is computed.
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
            // The pivot is final; the diagonal is replaced by the reciprocal of its root.
            self.log_density -= 0.5 * ln(lower[(i, i)]);
            lower[(i, i)] = 1.0 / sqrt(lower[(i, i)]);
            self.scale(i, lower[(i, i)]);
        }
        let mut rows = self.at[..D].iter().chain(&self.previous[..D]);
        if rows.all(|row| is_sound(row)) && is_sound(&self.residual[..D]) {
            self.count = D;
            return Ok(());
        }
        let mut numbers = self.at[..D].iter().chain(&self.previous[..D]).flatten().chain(&self.residual[..D]);
        let is_number = numbers.all(|x| x.is_finite());
        Err(if is_number { Refusal::OutOfRange } else { Refusal::NonFinite })
    }

    /// Sets the rows from a measurement at the keyframe.
    ///
    /// # Errors
    ///
    /// Those of the measurement and of [`set`](Self::set).
    pub fn measure<S: States, M: Measurement<D>, const D: usize>(
        &mut self,
        measurement: &M,
        at: &Estimate<N>,
    ) -> Result<(), Refusal> {
        let mut model = Linearised::<D, N>::new();
        measurement.linearise::<S, N>(at, &mut model)?;
        self.set(model.residual, None, &model.jacobian, &model.noise)
    }

    /// The whitened residual and Jacobian rows of the keyframe.
    pub(in crate::navigation) fn alone(&self) -> (&[f64], &[[f64; N]]) {
        (&self.residual[..self.count], &self.at[..self.count])
    }

    /// Leaves out rows that involve no state.
    pub(in crate::navigation) fn leave_out_empty(&mut self) {
        let mut kept = 0;
        for row in 0..self.count {
            if self.at[row].iter().chain(&self.previous[row]).any(|x| *x != 0.0) {
                self.at[kept] = self.at[row];
                self.previous[kept] = self.previous[row];
                self.residual[kept] = self.residual[row];
                kept += 1;
            }
        }
        self.count = kept;
    }

    /// Multiplies the weight. The rows are multiplied by its square root.
    pub(in crate::navigation) fn weigh(&mut self, weight: f64) {
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

/// Returns whether every component is finite and not absurd; larger whitened numbers cannot be measurements.
fn is_sound(row: &[f64]) -> bool {
    // A NaN is outside the range.
    row.iter().all(|x| (-1e15..=1e15).contains(x))
}
