//! Calibrates the magnetometer, from free motion.

use nalgebra::{ComplexField, Matrix3, Vector3};

use super::ellipsoid::{self, Point, Shape};
use super::{CalibrationError, Linear};

/// The magnetometer's calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MagnetometerFit {
    /// Hard iron, the offset, in the measurement's unit; and soft iron with scale, symmetric.
    pub calibration: Linear,
    /// The norm of calibrated fields.
    pub norm: f64,
    /// Standard deviations of the offset.
    pub offset_deviation: Vector3<f64>,
    /// Standard deviations of the matrix.
    pub matrix_deviation: Matrix3<f64>,
    /// Root mean square difference between the calibrated norm and `norm`.
    pub residual: f64,
    /// Root mean square difference between the uncalibrated norm and its mean.
    pub residual_before: f64,
}

/// The smallest number of measurements.
const LEAST: usize = 100;

/// The expected noise, as a fraction of the norm; larger noise shows in the residuals.
const NOISE: f64 = 0.005;

/// Consecutive measurements are assumed to share errors, for example from a disturbance of the surroundings: this
/// many count as one.
const ALIKE: f64 = 10.0;

/// The largest accepted standard deviation of offset and scale, as a fraction of the norm.
const LIMIT: f64 = 0.05;

/// The magnetometer's hard and soft iron from `fields`, measured in any unit while the sensor was turned in all
/// directions, far from iron that does not turn with it. With `norm`, the strength of the field where it was
/// measured, calibrated fields have that norm; otherwise they have the norm that preserves their volume.
///
/// A rotation of the field by soft iron, like any misalignment between magnetometer and body, is not observable in
/// the norm.
///
/// # Errors
///
/// Too few measurements, or too few directions; measurements that are not finite, or not on an ellipsoid.
pub fn magnetometer(fields: &[Vector3<f64>], norm: Option<f64>) -> Result<MagnetometerFit, CalibrationError> {
    let is_finite = |field: &Vector3<f64>| field.iter().all(|value| value.is_finite());
    if !fields.iter().all(is_finite) || norm.is_some_and(|norm| !(norm.is_finite() && norm > 0.0)) {
        return Err(CalibrationError::NonFinite);
    }
    if fields.len() < LEAST {
        let (what, found, needed) = ("measurements of the field", fields.len(), LEAST);
        return Err(CalibrationError::TooFew { what, found, needed });
    }
    let (centre, radius) = ellipsoid::sphere(fields.iter().copied()).ok_or(CalibrationError::NoEllipsoid)?;
    // In units of the radius, so that the numbers are near 1 for any unit.
    let points = fields
        .iter()
        .map(|field| Point { measured: (field - centre) / radius, deviation: NOISE * ComplexField::sqrt(ALIKE) });
    let fit = ellipsoid::fit(points, 1.0, Shape::Symmetric, Linear::IDENTITY)?;
    for (parameter, deviation) in
        [("offset", fit.offset_deviation.max()), ("scale", fit.matrix_deviation.diagonal().max())]
    {
        if deviation.is_nan() || deviation > LIMIT {
            return Err(CalibrationError::NotObservable { parameter, deviation, limit: LIMIT });
        }
    }
    // The norm for which the determinant is 1.
    let norm = norm.unwrap_or_else(|| radius / cube_root(fit.linear.matrix.determinant()));
    let mean = fields.iter().map(|field| field.norm()).sum::<f64>() / fields.len() as f64;
    let squares = fields.iter().map(|field| (field.norm() - mean) * (field.norm() - mean)).sum::<f64>();
    Ok(MagnetometerFit {
        calibration: Linear {
            offset: centre + fit.linear.offset * radius,
            matrix: fit.linear.matrix * (norm / radius),
        },
        norm,
        offset_deviation: fit.offset_deviation * radius,
        matrix_deviation: fit.matrix_deviation * (norm / radius),
        residual: fit.residual * norm,
        residual_before: ComplexField::sqrt(squares / fields.len() as f64),
    })
}

fn cube_root(value: f64) -> f64 {
    nalgebra::ComplexField::powf(value, 1.0 / 3.0)
}
