//! A camera model: projects points of the body to pixels, and pixels to directions.

#[cfg(test)]
mod tests;

use nalgebra::{Matrix2, Matrix2x3, UnitQuaternion, Vector2, Vector3};

use crate::navigation::numbers::PIXEL_STEPS;
use crate::navigation::refusal::Refusal;
use crate::params::ParamsError;

/// A pinhole camera with radial and tangential distortion, and its pose on the body. The optical axis is z; x points to
/// the right in the image and y points down.
///
/// With normalised coordinates `x = X / Z`, `y = Y / Z`, and `r² = x² + y²`, a point appears at
///
/// * `u = fx (x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²)) + cx`
/// * `v = fy (y (1 + k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2 y²) + 2 p2 x y) + cy`
///
/// D. C. Brown, "Decentering distortion of lenses", Photogrammetric Engineering 32(3), 1966, in the notation of OpenCV.
///
/// ```
/// use bb_estimators::navigation::Camera;
/// use nalgebra::{UnitQuaternion, Vector2, Vector3};
///
/// let camera = Camera {
///     distortion: [-0.28, 0.07, 0.0, 2e-4, 1e-5],
///     ..Camera::pinhole((458.0, 458.0), (376.0, 240.0), (752.0, 480.0))
/// };
/// let seen = camera.seen(&Vector3::new(1.0, 0.5, 4.0))?;
/// let from = camera.undistorted(&seen.pixel)?;
/// assert!((from.direction - Vector2::new(0.25, 0.125)).norm() < 1e-12);
/// # Ok::<(), bb_estimators::navigation::Refusal>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// fx, fy, pixels.
    pub focal_length: Vector2<f64>,
    /// cx, cy, pixels.
    pub centre: Vector2<f64>,
    /// Width and height of the image, pixels; points outside are not seen.
    pub size: Vector2<f64>,
    /// k1, k2, k3, p1, p2.
    pub distortion: [f64; 5],
    /// Rotates camera coordinates to the body.
    pub body_from_camera: UnitQuaternion<f64>,
    /// Position of the camera's centre in the body, m.
    pub position: Vector3<f64>,
}

/// A point in the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// u, v, pixels.
    pub pixel: Vector2<f64>,
    /// Derivative of the pixel with respect to the point, in the camera's axes, `2 × 3`.
    pub jacobian: Matrix2x3<f64>,
}

/// The direction that a pixel comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Undistorted {
    /// x, y at depth 1.
    pub direction: Vector2<f64>,
    /// Derivative of the pixel with respect to the direction, `2 × 2`.
    pub jacobian: Matrix2<f64>,
}

impl Camera {
    /// Creates a camera without distortion at the body's origin, with the body's axes. Focal lengths, principal point
    /// and size are in pixels.
    pub fn pinhole(focal_length: (f64, f64), centre: (f64, f64), size: (f64, f64)) -> Self {
        Self {
            focal_length: Vector2::new(focal_length.0, focal_length.1),
            centre: Vector2::new(centre.0, centre.1),
            size: Vector2::new(size.0, size.1),
            distortion: [0.0; 5],
            body_from_camera: UnitQuaternion::identity(),
            position: Vector3::zeros(),
        }
    }

    /// Checks that every number is finite and all lengths and sizes are positive.
    pub(in crate::navigation) fn check(&self) -> Result<(), ParamsError> {
        let lengths = [self.focal_length, self.size];
        let finite = |values: &[f64]| values.iter().all(|x| x.is_finite());
        let is_sound = lengths.iter().flatten().all(|x| *x > 0.0 && x.is_finite())
            && finite(self.centre.as_slice())
            && finite(&self.distortion)
            && finite(self.position.as_slice())
            && (self.body_from_camera.coords.norm() - 1.0).abs() < 1e-6;
        let (min, max) = (f64::MIN_POSITIVE, f64::MAX);
        let error = ParamsError { parameter: "camera", value: self.focal_length.x, min, max, unit: "px" };
        if is_sound { Ok(()) } else { Err(error) }
    }

    /// Projects a point in the camera's axes, m, to a pixel.
    ///
    /// # Errors
    ///
    /// [`Refusal::NotObservable`] if the point is not in front of the camera; [`Refusal::NonFinite`].
    pub fn seen(&self, point: &Vector3<f64>) -> Result<Seen, Refusal> {
        if !point.iter().all(|x| x.is_finite()) {
            return Err(Refusal::NonFinite);
        }
        let (direction, by_point) = normalised(point).ok_or(Refusal::NotObservable)?;
        let (pixel, by_direction) = self.distorted(&direction);
        let jacobian = by_direction * by_point;
        if !pixel.iter().chain(jacobian.iter()).all(|x| x.is_finite()) {
            return Err(Refusal::NotObservable);
        }
        Ok(Seen { pixel, jacobian })
    }

    /// Finds the direction of a pixel by Newton's method.
    ///
    /// # Errors
    ///
    /// [`Refusal::NonFinite`]; [`Refusal::OutOfRange`] if the pixel is outside the image, or is one that the lens
    /// cannot produce.
    pub fn undistorted(&self, pixel: &Vector2<f64>) -> Result<Undistorted, Refusal> {
        if !pixel.iter().all(|x| x.is_finite()) {
            return Err(Refusal::NonFinite);
        }
        if !(0..2).all(|i| (0.0..=self.size[i]).contains(&pixel[i])) {
            return Err(Refusal::OutOfRange);
        }
        let mut direction = (pixel - self.centre).component_div(&self.focal_length);
        for _ in 0..PIXEL_STEPS {
            let (expected, jacobian) = self.distorted(&direction);
            // Beyond the fold, where the distortion turns back, two directions share a pixel.
            let determinant = jacobian.determinant();
            if !determinant.is_finite() || determinant <= 0.0 {
                break;
            }
            let off = pixel - expected;
            if off.amax() < 1e-9 {
                return Ok(Undistorted { direction, jacobian });
            }
            let Some(inverse) = jacobian.try_inverse() else { break };
            direction += inverse * off;
        }
        Err(Refusal::OutOfRange)
    }

    /// The pixel of normalised coordinates, and its derivatives with respect to them.
    fn distorted(&self, direction: &Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
        let [k1, k2, k3, p1, p2] = self.distortion;
        let (x, y) = (direction.x, direction.y);
        let square = x * x + y * y;
        let radial = 1.0 + square * (k1 + square * (k2 + square * k3));
        // 2 ∂radial/∂r², with the factor 2 of ∂r²/∂x.
        let slope = 2.0 * (k1 + square * (2.0 * k2 + square * 3.0 * k3));
        let at = Vector2::new(
            x * radial + 2.0 * p1 * x * y + p2 * (square + 2.0 * x * x),
            y * radial + p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y,
        );
        let mixed = x * y * slope + 2.0 * (p1 * x + p2 * y);
        let by_direction = Matrix2::new(
            radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x,
            mixed,
            mixed,
            radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x,
        );
        let focal = Matrix2::from_diagonal(&self.focal_length);
        (self.focal_length.component_mul(&at) + self.centre, focal * by_direction)
    }
}

/// Normalised coordinates of a point, and their derivatives with respect to it; `None` if the point is not in front.
pub(in crate::navigation) fn normalised(point: &Vector3<f64>) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
    const NEAREST_M: f64 = 1e-3;
    if point.z.is_nan() || point.z <= NEAREST_M {
        return None;
    }
    let inverse = 1.0 / point.z;
    let (x, y) = (point.x * inverse, point.y * inverse);
    let jacobian = Matrix2x3::new(inverse, 0.0, -x * inverse, 0.0, inverse, -y * inverse);
    Some((Vector2::new(x, y), jacobian))
}
