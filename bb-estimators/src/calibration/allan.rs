//! The noise of a sensor at rest, by its Allan deviation.
//!
//! IEEE Std 952-1997, annex C: the overlapping estimate of the Allan variance, and how white noise, bias instability
//! and rate random walk appear in it,
//!
//! `σ²(τ) = N²/τ + (2 ln 2 / π) B² + K² τ/3`.
//!
//! The uncertainty of each variance follows W. J. Riley, D. A. Howe, "Handbook of Frequency Stability Analysis", NIST
//! Special Publication 1065, 2008, section 5.4.1: an estimate is χ² distributed, with degrees of freedom that depend
//! on the noise.

use core::error::Error;
use core::fmt;
use nalgebra::{ComplexField, Matrix3, Vector3};

/// Averaging times double, up to 2³¹ samples.
const OCTAVES: usize = 32;

/// The longest averaging time is this fraction of the whole, so that its deviation is known within a quarter: IEEE
/// 952, C.22.
const SHARE: usize = 9;

/// The smallest number of samples.
const LEAST: usize = 256;

/// The flat part of the curve, as a multiple of the bias instability: `√(2 ln 2 / π)`.
const FLOOR: f64 = 0.664_28;

/// The number of times the weights are recomputed with the fitted curve.
const ROUNDS: usize = 8;

/// One averaging time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AllanPoint {
    /// The averaging time τ, s.
    pub time_s: f64,
    /// The Allan deviation, in the unit of the sensor.
    pub deviation: f64,
    /// Relative standard deviation of the Allan deviation.
    pub relative_error: f64,
}

/// Allan deviations at averaging times of 1, 2, 4, … samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AllanCurve {
    points: [AllanPoint; OCTAVES],
    count: usize,
}

/// The components of a sensor's noise; all in the unit of the sensor, rad/s or m/s².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorNoise {
    /// White noise N, unit/√Hz: angle random walk of a gyroscope, velocity random walk of an accelerometer.
    pub density: Known,
    /// Bias instability, unit: the lowest point of the curve over 0.664; at the longest averaging time it is an upper limit.
    pub bias_instability: f64,
    /// The averaging time of the lowest point, s.
    pub bias_instability_time_s: f64,
    /// `true` if the curve rises again, so that the lowest point is a minimum.
    pub is_lowest: bool,
    /// Rate random walk K, unit/s/√Hz.
    pub random_walk: Known,
    /// The Allan deviations they were computed from.
    pub curve: AllanCurve,
}

/// A number and its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Known {
    /// The best value; 0 if it is not observed.
    pub value: f64,
    /// One standard deviation.
    pub deviation: f64,
    /// Upper limit with a confidence of 97.7 %: the square of the value is known within two of its deviations.
    pub at_most: f64,
}

/// Reason for which the noise cannot be computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AllanError {
    /// There are too few samples.
    TooShort {
        /// The number of samples.
        samples: usize,
        /// The smallest number required.
        least: usize,
    },
    /// All samples are equal.
    Constant,
    /// Samples vary by less than any sensor can resolve, or by more than can be computed with.
    Unlikely {
        /// An Allan deviation, in the unit of the samples.
        deviation: f64,
    },
    /// A sample is NaN or infinite, or the period is not positive.
    NonFinite,
}

impl fmt::Display for AllanError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooShort { samples, least } => write!(f, "{samples} samples are too few: {least} are the least"),
            Self::Constant => f.write_str("all samples are the same"),
            Self::Unlikely { deviation } => {
                write!(f, "samples vary by {deviation:.1e}, which no sensor does: are they scaled by mistake?")
            }
            Self::NonFinite => f.write_str("a sample is not finite"),
        }
    }
}

impl Error for AllanError {}

/// The range of a sensor's variation: outside it, the powers of it used by the fit overflow or underflow.
const DEVIATIONS: core::ops::RangeInclusive<f64> = 1e-30..=1e30;

/// Replaces samples by their integral in samples, with the mean removed: `out[k]` is the sum of the first k. The
/// slice begins with one extra element, which is ignored; n samples have n + 1 integrals.
///
/// ```
/// use bb_estimators::calibration::integrate;
///
/// let mut rates = [0.0, 1.0, 3.0];
/// integrate(&mut rates);
/// assert_eq!(rates, [0.0, -1.0, 0.0]);
/// ```
pub fn integrate(samples: &mut [f64]) {
    let count = samples.len().saturating_sub(1).max(1) as f64;
    // Relative to the first sample, so that a large bias costs no digits.
    let first = samples.get(1).copied().unwrap_or(0.0);
    let mean = samples.iter().skip(1).map(|sample| sample - first).sum::<f64>() / count;
    let mut sum = 0.0;
    if let Some(none) = samples.first_mut() {
        *none = 0.0;
    }
    for sample in samples.iter_mut().skip(1) {
        sum += (*sample - first) - mean;
        *sample = sum;
    }
}

/// The overlapping Allan deviation over `m` samples, from the integrals computed by [`integrate`]; `None` if there
/// are fewer than `2 m + 1` of them.
///
/// `σ²(m τ₀) = Σ (θ[k + 2m] - 2 θ[k + m] + θ[k])² / (2 m² (n - 2m))`, IEEE 952, C.14, with θ in samples.
pub fn allan_deviation(integrals: &[f64], m: usize) -> Option<f64> {
    let terms = integrals.len().checked_sub(m.checked_mul(2)?)?;
    if terms == 0 || m == 0 {
        return None;
    }
    let (first, middle, last) = (integrals, integrals.get(m..)?, integrals.get(2 * m..)?);
    let differences = first.iter().zip(middle).zip(last).map(|((a, b), c)| (c - b) - (b - a));
    let sum: f64 = differences.map(|difference| difference * difference).sum();
    Some(sqrt(sum / (2.0 * terms as f64)) / m as f64)
}

/// The noise components of a sensor at rest, from the integrals computed by [`integrate`] and the period of the
/// samples.
///
/// The curve is fitted by weighted least squares, with no component negative; the deviations account for the samples
/// shared by neighbouring averaging times.
///
/// # Errors
///
/// [`AllanError`]: too few samples, all equal, or one that is not finite.
pub fn sensor_noise(integrals: &[f64], period_s: f64) -> Result<SensorNoise, AllanError> {
    let samples = integrals.len().saturating_sub(1);
    if samples < LEAST {
        return Err(AllanError::TooShort { samples, least: LEAST });
    }
    let is_period = period_s > 0.0 && period_s.is_finite();
    if !is_period || integrals.iter().any(|integral| !integral.is_finite()) {
        return Err(AllanError::NonFinite);
    }
    let mut curve = AllanCurve { points: [AllanPoint::default(); OCTAVES], count: 0 };
    let mut m = 1;
    while m <= samples / SHARE && curve.count < OCTAVES {
        let deviation = allan_deviation(integrals, m).unwrap_or(0.0);
        if deviation <= 0.0 {
            // The square of a tiny number is 0 as well.
            let largest = integrals.iter().fold(0.0, |largest: f64, integral| largest.max(integral.abs()));
            return Err(if largest > 0.0 {
                AllanError::Unlikely { deviation: largest }
            } else {
                AllanError::Constant
            });
        }
        if !DEVIATIONS.contains(&deviation) {
            return Err(AllanError::Unlikely { deviation });
        }
        curve.points[curve.count] = AllanPoint { time_s: m as f64 * period_s, deviation, relative_error: 0.0 };
        curve.count += 1;
        m *= 2;
    }
    let fitted = curve.fit(integrals.len());
    let (mut lowest, mut index) = (f64::INFINITY, 0);
    for (i, point) in curve.points().iter().enumerate() {
        if point.deviation < lowest {
            (lowest, index) = (point.deviation, i);
        }
    }
    Ok(SensorNoise {
        density: fitted.known(0),
        random_walk: fitted.known(2),
        bias_instability: lowest / FLOOR,
        bias_instability_time_s: curve.points[index].time_s,
        is_lowest: index + 1 < curve.count,
        curve,
    })
}

/// Squares of N, `√(2 ln 2 / π) B` and K, and their covariance.
struct Fitted {
    squares: Vector3<f64>,
    covariance: Matrix3<f64>,
}

impl Fitted {
    fn known(&self, i: usize) -> Known {
        let (square, spread) = (self.squares[i], sqrt(self.covariance[(i, i)].max(0.0)));
        let value = sqrt(square);
        // If the square is poorly known, its root is no better than the root of its deviation.
        let deviation = if square > spread { spread / (2.0 * value) } else { sqrt(spread) / 2.0 };
        Known { value, deviation, at_most: sqrt(square + 2.0 * spread) }
    }
}

/// The contribution of each component to the Allan variance at τ, for a square of 1.
fn parts(time_s: f64) -> Vector3<f64> {
    Vector3::new(1.0 / time_s, 1.0, time_s / 3.0)
}

impl AllanCurve {
    /// Returns the points by increasing averaging time.
    pub fn points(&self) -> &[AllanPoint] {
        self.points.get(..self.count).unwrap_or(&[])
    }

    /// Fits the components, and fills in the uncertainty of each point; `integrals` is their number.
    fn fit(&mut self, integrals: usize) -> Fitted {
        let mut fitted = Fitted { squares: Vector3::zeros(), covariance: Matrix3::zeros() };
        // For each point: the dominant noise, and the weight times its deviation.
        let mut seen = [(0, Vector3::zeros()); OCTAVES];
        for round in 0..ROUNDS {
            let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
            for (i, point) in self.points.iter_mut().take(self.count).enumerate() {
                let parts = parts(point.time_s);
                let shares = parts.component_mul(&fitted.squares);
                let measured = point.deviation * point.deviation;
                let variance = if round == 0 { measured } else { shares.sum() };
                let noise = shares.imax();
                let freedom = degrees_of_freedom(noise, integrals as f64, (1_u64 << i) as f64);
                point.relative_error = sqrt(0.5 / freedom);
                let weight = freedom / (2.0 * variance * variance);
                normal += parts * parts.transpose() * weight;
                right += parts * (measured * weight);
                seen[i] = (noise, parts * sqrt(weight));
            }
            fitted.squares = least_squares(&normal, &right);
            let mut spread = Matrix3::zeros();
            for (i, (noise, a)) in seen.iter().take(self.count).enumerate() {
                spread += a * a.transpose();
                for (lag, (_, b)) in (1..).zip(seen.iter().take(self.count).skip(i + 1)) {
                    spread += (a * b.transpose() + b * a.transpose()) * correlation(*noise, lag);
                }
            }
            let inverse = scaled_inverse(&normal).unwrap_or_else(Matrix3::zeros);
            fitted.covariance = inverse * spread * inverse;
        }
        fitted
    }
}

/// Correlation of the Allan variances over m and 2^lag m samples, under white noise (0), flicker noise (1) or a
/// random walk (2): both are sums over one spectrum, whose windows `sin⁴x / x²⁺ⁿ` overlap; integrated numerically
/// here.
fn correlation(noise: usize, lag: i32) -> f64 {
    let (first, ratio) = match noise {
        0 => ([0.530, 0.188, 0.066, 0.023], 0.35),
        1 => ([0.689, 0.309, 0.121, 0.045], 0.37),
        _ => ([0.888, 0.676, 0.488, 0.346], 0.71),
    };
    let known = usize::try_from(lag - 1).ok().and_then(|index| first.get(index));
    known.copied().unwrap_or_else(|| first[3] * ComplexField::powi(ratio, lag - 4))
}

/// Minimises `xᵀ A x - 2 bᵀ x` over non-negative x, always including white noise: the best feasible one of all
/// subsets of the components.
fn least_squares(normal: &Matrix3<f64>, right: &Vector3<f64>) -> Vector3<f64> {
    let mut best = Vector3::new(right[0] / normal[(0, 0)], 0.0, 0.0);
    let cost = |x: &Vector3<f64>| x.dot(&(normal * x)) - 2.0 * right.dot(x);
    for (has_floor, has_walk) in [(true, false), (false, true), (true, true)] {
        let (mut reduced, mut side) = (*normal, *right);
        for (i, has) in [(1, has_floor), (2, has_walk)] {
            if !has {
                reduced.row_mut(i).fill(0.0);
                reduced.column_mut(i).fill(0.0);
                reduced[(i, i)] = normal[(i, i)];
                side[i] = 0.0;
            }
        }
        let Some(inverse) = scaled_inverse(&reduced) else { continue };
        let x = inverse * side;
        if x.iter().all(|part| *part >= 0.0) && cost(&x) < cost(&best) {
            best = x;
        }
    }
    best
}

/// The inverse of a matrix whose diagonal spans many orders of magnitude.
fn scaled_inverse(matrix: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let scale = Matrix3::from_diagonal(&matrix.diagonal().map(|square| 1.0 / sqrt(square)));
    (scale * matrix * scale).try_inverse().map(|inverse| scale * inverse * scale)
}

fn sqrt(x: f64) -> f64 {
    // Fully qualified: the method of `f64` needs the standard library.
    ComplexField::sqrt(x)
}

/// Returns the degrees of freedom of an overlapping Allan variance over m of n integrals, under white noise (0), flicker noise (1) or a
/// random walk (2).
fn degrees_of_freedom(noise: usize, n: f64, m: f64) -> f64 {
    let degrees = match noise {
        0 => (3.0 * (n - 1.0) / (2.0 * m) - 2.0 * (n - 2.0) / n) * (4.0 * m * m) / (4.0 * m * m + 5.0),
        1 if m < 2.0 => 2.0 * (n - 2.0) * (n - 2.0) / (2.3 * n - 4.9),
        1 => 5.0 * n * n / (4.0 * m * (n + 3.0 * m)),
        _ => (n - 2.0) / m * ((n - 1.0) * (n - 1.0) - 3.0 * m * (n - 1.0) + 4.0 * m * m) / ((n - 3.0) * (n - 3.0)),
    };
    degrees.max(1.0)
}

#[cfg(test)]
mod tests;
