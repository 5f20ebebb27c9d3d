//! The constant offset of a magnetometer, as the centre of a sphere.

use bb_core::nalgebra::{Matrix3, Matrix4, Vector3, Vector4};

/// Readings taken at most.
const MOST: usize = 20_000;
/// The Earth's field, T.
const EARTH: std::ops::Range<f64> = 15e-6..100e-6;
/// Directions in which the field was seen: the smallest eigenvalue of their mean square, 1/3 for all evenly.
const SEEN: f64 = 0.05;
/// An offset is worth a remark above this part of the field, if with it the norm varies this many times less.
const LARGE: f64 = 0.2;
const STEADIER: f64 = 2.0;

/// The offset and the norm without it, T; `None` if the readings do not show one.
pub(super) fn offset(fields: &[(f64, Vector3<f64>)]) -> Option<(Vector3<f64>, f64)> {
    let every = fields.len().div_ceil(MOST).max(1);
    // In µT, about their mean.
    let taken: Vec<Vector3<f64>> = fields.iter().step_by(every).map(|(_, field)| field * 1e6).collect();
    let count = taken.len() as f64;
    let mean = taken.iter().sum::<Vector3<f64>>() / count;
    let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
    for field in &taken {
        let field = field - mean;
        let row = Vector4::new(2.0 * field.x, 2.0 * field.y, 2.0 * field.z, 1.0);
        normal += row * row.transpose();
        right += row * field.norm_squared();
    }
    let solved = normal.cholesky()?.solve(&right);
    let centre = solved.xyz() + mean;
    let deviation = |from: &Vector3<f64>| {
        let norms = || taken.iter().map(|field| (field - from).norm());
        let mean = norms().sum::<f64>() / count;
        (mean, (norms().map(|norm| (norm - mean).powi(2)).sum::<f64>() / count).sqrt())
    };
    let (raw, (norm, left)) = (deviation(&Vector3::zeros()), deviation(&centre));
    let seen = taken.iter().fold(Matrix3::zeros(), |sum, field| {
        let direction = (field - centre).normalize();
        sum + direction * direction.transpose()
    });
    let seen = (seen / count).symmetric_eigenvalues().min();
    let is_seen = seen > SEEN && EARTH.contains(&(norm * 1e-6));
    let is_large = centre.norm() > LARGE * norm && raw.1 > STEADIER * left;
    (is_seen && is_large).then_some((centre * 1e-6, norm * 1e-6))
}

/// The offset in words.
pub(super) fn remark(offset: &Vector3<f64>, norm: f64) -> String {
    let [x, y, z] = (offset * 1e6).into();
    format!(
        "the magnetometer is not calibrated: its readings lie on a sphere of {:.0} µT about ({x:.0}, {y:.0}, {z:.0}) µT",
        norm * 1e6
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Directions all around.
    fn fields(offset: Vector3<f64>) -> Vec<(f64, Vector3<f64>)> {
        let direction = |index: i32| {
            let (a, b) = (f64::from(index) * 0.7, f64::from(index) * 0.31);
            Vector3::new(a.cos() * b.cos(), a.sin() * b.cos(), b.sin())
        };
        (0..2000).map(|index| (f64::from(index) * 0.01, direction(index) * 48e-6 + offset)).collect()
    }

    #[test]
    fn an_offset_is_found_where_there_is_one() {
        let wanted = Vector3::new(20e-6, -35e-6, 10e-6);
        let (found, norm) = offset(&fields(wanted)).expect("has one");
        assert!((found - wanted).norm() < 1e-7 && (norm - 48e-6).abs() < 1e-7);
        assert_eq!(
            remark(&found, norm),
            "the magnetometer is not calibrated: its readings lie on a sphere of 48 µT about (20, -35, 10) µT"
        );
        assert_eq!(offset(&fields(Vector3::zeros())), None);
        assert_eq!(offset(&fields(Vector3::new(4e-6, 0.0, 0.0))), None);
        // A sensor that hardly turns does not show it.
        let still: Vec<_> =
            fields(wanted).into_iter().map(|(time_s, field)| (time_s, field * 0.001 + wanted)).collect();
        assert_eq!(offset(&still), None);
        assert_eq!(offset(&[]), None);
    }
}
