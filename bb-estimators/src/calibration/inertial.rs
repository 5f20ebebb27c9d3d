//! Calibrates gyroscope and accelerometer from rests.

use nalgebra::{ComplexField, Matrix3, Vector3};

use super::ellipsoid::{self, Point, Shape};
use super::{CalibrationError, Linear, Rest};

/// A fitted offset of the gyroscope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GyroscopeFit {
    /// The reading at rest, rad/s, body frame.
    pub offset: Vector3<f64>,
    /// Standard deviation of each axis: from the noise of the mean and the spread of the rests.
    pub deviation: Vector3<f64>,
    /// Root mean square difference between the rests and the offset, rad/s, per component.
    pub residual: f64,
}

/// The fitted parameters of the accelerometer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Model {
    /// Offset and scale: with six to eight directions.
    Scale,
    /// Scale and misalignment: with at least nine directions.
    ScaleAndMisalignment,
}

/// A fitted calibration of the accelerometer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AccelerometerFit {
    /// Offset, m/s², and scale with misalignment, upper triangular.
    pub calibration: Linear,
    /// The fitted parameters.
    pub model: Model,
    /// Number of directions at rest; those within 15° count as one.
    pub directions: usize,
    /// Standard deviations of the offset, m/s².
    pub offset_deviation: Vector3<f64>,
    /// Standard deviations of the matrix.
    pub matrix_deviation: Matrix3<f64>,
    /// Root mean square difference between the calibrated norm and gravity over the rests, m/s².
    pub residual: f64,
    /// Root mean square difference between the uncalibrated norm and gravity over the rests, m/s².
    pub residual_before: f64,
}

/// Cosine of the angle within which two directions count as one.
const SAME_DIRECTION: f64 = 0.966;

/// Error of the mean of a rest beyond its noise, m/s²: a bias that drifts, a table that trembles. 0.2 mg.
const INSTABILITY: f64 = 2e-3;

/// The smallest numbers of directions that determine offset and scale, and misalignment too.
const FOR_SCALE: usize = 6;
const FOR_MISALIGNMENT: usize = 9;

/// The largest accepted standard deviation of scale and of offset, as a fraction of gravity.
const LARGEST_DEVIATION: f64 = 0.01;

/// Fits the gyroscope's offset: the mean over the rests, weighted by their length.
///
/// # Errors
///
/// There is no rest, or a value is not finite.
pub fn gyroscope(rests: &[Rest]) -> Result<GyroscopeFit, CalibrationError> {
    if rests.is_empty() {
        return Err(CalibrationError::TooFew { what: "rests", found: 0, needed: 1 });
    }
    let samples: f64 = rests.iter().map(|rest| rest.samples as f64).sum();
    let offset = rests.iter().map(|rest| rest.rate * rest.samples as f64).sum::<Vector3<f64>>() / samples;
    let noise =
        rests.iter().map(|rest| rest.rate_deviation * rest.rate_deviation * rest.samples as f64).sum::<f64>();
    let square = |rest: &Rest| (rest.rate - offset).component_mul(&(rest.rate - offset));
    let spread = rests.iter().map(square).sum::<Vector3<f64>>() / rests.len() as f64;
    if !offset.iter().chain(spread.iter()).all(|value| value.is_finite()) {
        return Err(CalibrationError::NonFinite);
    }
    // The deviation of the mean over all samples, or over the rests if they differ by more.
    let from_noise = noise / (samples * samples);
    let others = rests.len().saturating_sub(1).max(1) as f64;
    let deviation = spread.map(|variance| ComplexField::sqrt((variance / others).max(from_noise)));
    Ok(GyroscopeFit { offset, deviation, residual: ComplexField::sqrt(spread.mean()) })
}

/// Fits the accelerometer's offset and scale to rests in six directions, and its misalignment to nine. At rest it
/// measures `gravity`, m/s², in any direction. Poses need not be exact.
///
/// # Errors
///
/// Too few directions, or directions that do not determine all parameters; rests that are not finite, or that no
/// calibration explains.
pub fn accelerometer(rests: &[Rest], gravity: f64) -> Result<AccelerometerFit, CalibrationError> {
    let is_finite =
        |rest: &Rest| rest.force.iter().all(|value| value.is_finite()) && rest.force_deviation.is_finite();
    if !(rests.iter().all(is_finite) && gravity.is_finite() && gravity > 0.0) {
        return Err(CalibrationError::NonFinite);
    }
    let directions = directions(rests);
    let (shape, model) = match directions {
        ..FOR_SCALE => {
            return Err(CalibrationError::TooFew {
                what: "directions in which it rested",
                found: directions,
                needed: FOR_SCALE,
            });
        }
        FOR_SCALE..FOR_MISALIGNMENT => (Shape::Diagonal, Model::Scale),
        _ => (Shape::Triangular, Model::ScaleAndMisalignment),
    };
    // Readings in g are as good a start as readings in m/s².
    let norm = rests.iter().map(|rest| rest.force.norm()).sum::<f64>() / rests.len() as f64;
    let scale = gravity / norm.max(f64::MIN_POSITIVE);
    let start = Linear { offset: Vector3::zeros(), matrix: Matrix3::identity() * scale };
    let points = rests.iter().map(|rest| {
        let noise = rest.force_deviation * scale;
        let deviation = ComplexField::sqrt(noise * noise / rest.samples as f64 + INSTABILITY * INSTABILITY);
        Point { measured: rest.force, deviation }
    });
    let fit = ellipsoid::fit(points, gravity, shape, start)?;
    let checks = [
        ("offset", fit.offset_deviation.max() * scale / gravity),
        ("scale", fit.matrix_deviation.diagonal().max() / scale),
    ];
    for (parameter, deviation) in checks {
        if deviation.is_nan() || deviation > LARGEST_DEVIATION {
            return Err(CalibrationError::NotObservable { parameter, deviation, limit: LARGEST_DEVIATION });
        }
    }
    let square = |rest: &Rest| (rest.force.norm() - gravity) * (rest.force.norm() - gravity);
    let before = rests.iter().map(square).sum::<f64>() / rests.len() as f64;
    Ok(AccelerometerFit {
        calibration: fit.linear,
        model,
        directions,
        offset_deviation: fit.offset_deviation,
        matrix_deviation: fit.matrix_deviation,
        residual: fit.residual,
        residual_before: ComplexField::sqrt(before),
    })
}

/// Counts the directions of the rests that are not near an earlier one.
fn directions(rests: &[Rest]) -> usize {
    let near = |a: &Rest, b: &Rest| a.force.dot(&b.force) > SAME_DIRECTION * a.force.norm() * b.force.norm();
    let is_new = |index: &usize| !rests[..*index].iter().any(|before| near(before, &rests[*index]));
    (0..rests.len()).filter(is_new).count()
}
