//! What a window is made of besides the IMU, and how to add to it.

use nalgebra::SMatrix;

use super::matrix::is_sound;
use super::relative::compare;
use crate::navigation::eskf::{Estimate, Refusal, States};
use crate::navigation::math::{ln, sqrt};
use crate::navigation::measurement::{
    AbsolutePose, BarometricHeight, BodyVelocity, GnssHeading, GnssPosition, GnssVelocity, Height, Linearised,
    MagneticField, MagneticHeading, Measurement, NonHolonomic, RelativePose, WheelSpeed, ZeroRotation,
    ZeroVelocity,
};

/// The most numbers that one factor compares.
pub const MOST_ROWS: usize = 9;

/// What was measured at one keyframe, or between it and the one before.
///
/// Every [`Measurement`] is one: [`Rows::measure`] is all there is to do for it. For factors of several kinds in one window,
/// write an enum.
///
/// ```
/// use bb_estimators::navigation::{Estimate, NavigationFactor, Factor, Refusal, Rows, States, POSITION};
/// use nalgebra::{Matrix1, SMatrix, Vector3};
///
/// /// What is usual, and ranges to a beacon at a known place.
/// #[derive(Clone, Copy, Debug)]
/// enum RangesToo {
///     Navigation(NavigationFactor),
///     Range { beacon: Vector3<f64>, distance_m: f64, deviation_m: f64 },
/// }
///
/// impl<S: States, const N: usize> Factor<S, N> for RangesToo {
///     fn previous(&self) -> Option<u64> {
///         match self {
///             Self::Navigation(factor) => Factor::<S, N>::previous(factor),
///             Self::Range { .. } => None,
///         }
///     }
///
///     fn linearise(
///         &self,
///         previous: Option<&Estimate<N>>,
///         at: &Estimate<N>,
///         rows: &mut Rows<N>,
///     ) -> Result<(), Refusal> {
///         match self {
///             Self::Navigation(factor) => Factor::<S, N>::linearise(factor, previous, at, rows),
///             Self::Range { beacon, distance_m, deviation_m } => {
///                 let offset = at.position - beacon;
///                 let direction = offset.try_normalize(1e-3).ok_or(Refusal::NotObservable)?;
///                 let mut jacobian = [[0.0; N]];
///                 for k in 0..3 {
///                     jacobian[0][POSITION + k] = direction[k];
///                 }
///                 rows.set([distance_m - offset.norm()], None, &jacobian, &Matrix1::new(deviation_m * deviation_m))
///             }
///         }
///     }
/// }
/// ```
pub trait Factor<S: States, const N: usize> {
    /// The keyframe before, by its id, if the factor concerns that as well.
    fn previous(&self) -> Option<u64> {
        None
    }

    /// Compares with what the estimates make expect. `previous` is there if [`previous`](Self::previous) named one.
    ///
    /// # Errors
    ///
    /// Why it cannot be, [`Refusal::NotObservable`] for one.
    fn linearise(
        &self,
        previous: Option<&Estimate<N>>,
        at: &Estimate<N>,
        rows: &mut Rows<N>,
    ) -> Result<(), Refusal>;
}

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
    /// numbers that are none or absurd.
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

macro_rules! navigation_factors {
    ($($measurement:ident),* $(,)?) => {
        /// The measurements of this crate as factors. [`RelativePose`] is between a keyframe and the one before.
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[allow(missing_docs, reason = "each is documented as a measurement")]
        pub enum NavigationFactor {
            RelativePose(RelativePose),
            $($measurement($measurement),)*
        }

        impl From<RelativePose> for NavigationFactor {
            fn from(measurement: RelativePose) -> Self {
                Self::RelativePose(measurement)
            }
        }

        $(impl From<$measurement> for NavigationFactor {
            fn from(measurement: $measurement) -> Self {
                Self::$measurement(measurement)
            }
        })*

        impl<S: States, const N: usize> Factor<S, N> for NavigationFactor {
            fn previous(&self) -> Option<u64> {
                match self {
                    Self::RelativePose(measurement) => Some(measurement.keyframe),
                    _ => None,
                }
            }

            fn linearise(
                &self,
                previous: Option<&Estimate<N>>,
                at: &Estimate<N>,
                rows: &mut Rows<N>,
            ) -> Result<(), Refusal> {
                match self {
                    Self::RelativePose(measurement) => {
                        let missing = Refusal::NoKeyframe { id: measurement.keyframe };
                        compare::<S, N>(measurement, previous.ok_or(missing)?, at, rows)
                    }
                    $(Self::$measurement(measurement) => rows.measure::<S, _, _>(measurement, at),)*
                }
            }
        }
    };
}

navigation_factors!(
    AbsolutePose,
    BarometricHeight,
    BodyVelocity,
    GnssHeading,
    GnssPosition,
    GnssVelocity,
    Height,
    MagneticField,
    MagneticHeading,
    NonHolonomic,
    WheelSpeed,
    ZeroRotation,
    ZeroVelocity,
);
