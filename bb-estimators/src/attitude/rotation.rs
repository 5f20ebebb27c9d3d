//! Rotations of a unit quaternion, written out to be cheap and to keep the norm.
//!
//! Each keeps the norm up to rounding, and [`renormalised`] removes the rounding once per sample, without a root or a
//! division.

use nalgebra::{Matrix3, Quaternion, Unit, UnitQuaternion, Vector3};

use super::Real;

/// Squared angle, rad², below which sine and cosine of the half angle are computed by series.
pub(super) const SERIES_SQUARED_ANGLE: f64 = 0.01;

/// Cosine of half an angle, and the factor that makes the sine of half of it of the angle, for its square, rad².
#[inline]
pub(super) fn half_angle<T: Real>(squared_angle: T) -> (T, T) {
    if squared_angle < T::of(SERIES_SQUARED_ANGLE) {
        return series_of_half_angle(squared_angle);
    }
    let angle = squared_angle.sqrt();
    let (sin, cos) = (T::HALF * angle).sin_cos();
    (cos, sin / angle)
}

/// [`half_angle`] below [`SERIES_SQUARED_ANGLE`]: with h = (θ/2)² below 0.0025, the first omitted terms are below
/// 1e-19.
#[inline]
fn series_of_half_angle<T: Real>(squared_angle: T) -> (T, T) {
    let h = T::of(0.25) * squared_angle;
    let (c6, s6) =
        (T::of(1.0 / 720.0) - h * T::of(1.0 / 40320.0), T::of(1.0 / 10080.0) - h * T::of(1.0 / 725_760.0));
    (
        T::ONE - h * (T::HALF - h * (T::of(1.0 / 24.0) - h * c6)),
        T::HALF - h * (T::of(1.0 / 12.0) - h * (T::of(1.0 / 240.0) - h * s6)),
    )
}

/// `world_from_body ⊗ exp(½ rotation)`: turns the body by a rotation vector given in the body frame, rad.
#[inline]
pub(super) fn turn<T: Real>(world_from_body: &UnitQuaternion<T>, rotation: &Vector3<T>) -> UnitQuaternion<T> {
    let (cos, scale) = half_angle(rotation.norm_squared());
    let (x, y, z) = (scale * rotation.x, scale * rotation.y, scale * rotation.z);
    let q = world_from_body;
    unit(
        cos * q.w - q.i * x - q.j * y - q.k * z,
        cos * q.i + q.w * x + q.j * z - q.k * y,
        cos * q.j + q.w * y + q.k * x - q.i * z,
        cos * q.k + q.w * z + q.i * y - q.j * x,
    )
}

/// [`turn`] by a rotation whose squared angle, `squared`, is below [`SERIES_SQUARED_ANGLE`].
#[inline]
pub(super) fn turn_little<T: Real>(
    world_from_body: &UnitQuaternion<T>,
    rotation: &Vector3<T>,
    squared: T,
) -> UnitQuaternion<T> {
    normalised(&turn_by_tangent(world_from_body, &(rotation * tangent_of_half(squared))))
}

/// The factor that makes the tangent of half of it of an angle, for its square, rad², below [`SERIES_SQUARED_ANGLE`]: the
/// first term left out is below 1e-12.
#[inline]
pub(super) fn tangent_of_half<T: Real>(squared_angle: T) -> T {
    let s = squared_angle;
    T::HALF + s * (T::of(1.0 / 24.0) + s * (T::of(1.0 / 240.0) + s * T::of(17.0 / 40320.0)))
}

/// `world_from_body ⊗ (1, tangent)`: turns the body about a vector given in the body frame, by twice the arc tangent of
/// its length. Cheaper than [`turn`], and the same but for the third order. The result is longer than `world_from_body`.
#[inline]
pub(super) fn turn_by_tangent<T: Real>(world_from_body: &Quaternion<T>, tangent: &Vector3<T>) -> Quaternion<T> {
    let (q, x, y, z) = (world_from_body, tangent.x, tangent.y, tangent.z);
    Quaternion::new(
        q.w - q.i * x - q.j * y - q.k * z,
        q.i + q.w * x + q.j * z - q.k * y,
        q.j + q.w * y + q.k * x - q.i * z,
        q.k + q.w * z + q.i * y - q.j * x,
    )
}

/// `quaternion` brought to unit norm; it is not zero.
#[inline]
pub(super) fn normalised<T: Real>(quaternion: &Quaternion<T>) -> UnitQuaternion<T> {
    let q = quaternion;
    let scale = T::ONE / (q.w * q.w + q.i * q.i + q.j * q.j + q.k * q.k).sqrt();
    unit(q.w * scale, q.i * scale, q.j * scale, q.k * scale)
}

/// Turns `world_from_body` about the world's vertical by `angle`, rad, counter-clockwise seen from above.
pub(super) fn turn_heading<T: Real>(world_from_body: &UnitQuaternion<T>, angle: T) -> UnitQuaternion<T> {
    let (sin, cos) = (T::HALF * angle).sin_cos();
    turn_heading_by(world_from_body, [cos, sin])
}

/// Turns `world_from_body` about the world's vertical by an angle, given by cosine and sine of its half.
#[inline]
pub(super) fn turn_heading_by<T: Real>(world_from_body: &UnitQuaternion<T>, [c, s]: [T; 2]) -> UnitQuaternion<T> {
    let q = world_from_body;
    unit(c * q.w - s * q.k, c * q.i - s * q.j, c * q.j + s * q.i, c * q.k + s * q.w)
}

/// Turns `world_from_body` by the shortest rotation, about a horizontal axis, that takes the world vector `up`
/// to the vertical. `up` may have any length but 0. If it points straight down, the axis is east.
pub(super) fn turn_upright<T: Real>(world_from_body: &UnitQuaternion<T>, up: &Vector3<T>) -> UnitQuaternion<T> {
    // Along (n + z, y, -x, 0) with n the norm of `up`. Next to straight down n + z cancels, and
    // (x² + y²) / (n - z) is the same number without that.
    let horizontal = up.x * up.x + up.y * up.y;
    let norm = (horizontal + up.z * up.z).sqrt();
    let w = if up.z > T::ZERO { norm + up.z } else { horizontal / (norm - up.z) };
    let squared = w * w + horizontal;
    let (w, x, y) = if squared > T::ZERO {
        let scale = T::ONE / squared.sqrt();
        (w * scale, up.y * scale, -up.x * scale)
    } else {
        (T::ZERO, T::ONE, T::ZERO)
    };
    let q = world_from_body;
    unit(
        w * q.w - x * q.i - y * q.j,
        w * q.i + x * q.w + y * q.k,
        w * q.j + y * q.w - x * q.k,
        w * q.k + x * q.j - y * q.i,
    )
}

/// The matrix of a rotation: `to_rotation_matrix` of nalgebra for a norm of 1, for two thirds of its instructions.
#[inline(always)]
pub(super) fn matrix<T: Real>(world_from_body: &UnitQuaternion<T>) -> Matrix3<T> {
    let q = world_from_body;
    let [x, y, z] = [q.i + q.i, q.j + q.j, q.k + q.k];
    let [xx, yy, zz] = [x * q.i, y * q.j, z * q.k];
    let [xy, xz, yz] = [x * q.j, x * q.k, y * q.k];
    let [wx, wy, wz] = [x * q.w, y * q.w, z * q.w];
    let (one, w) = (T::ONE - zz, T::ONE - xx);
    Matrix3::new(one - yy, xy - wz, xz + wy, xy + wz, one - xx, yz - wx, xz - wy, yz + wx, w - yy)
}

/// `orientation` with its norm, which is 1 up to rounding, restored to 1.
pub(super) fn renormalised<T: Real>(orientation: &UnitQuaternion<T>) -> UnitQuaternion<T> {
    let q = orientation;
    // One step of Newton's method for 1/√n at n = 1.
    let scale = T::of(1.5) - T::HALF * (q.w * q.w + q.i * q.i + q.j * q.j + q.k * q.k);
    unit(q.w * scale, q.i * scale, q.j * scale, q.k * scale)
}

fn unit<T: Real>(w: T, x: T, y: T, z: T) -> UnitQuaternion<T> {
    Unit::new_unchecked(Quaternion::new(w, x, y, z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_exponential_at_every_angle() {
        let start = UnitQuaternion::<f64>::from_euler_angles(0.3, -1.1, 2.0);
        let axis = Vector3::new(0.48, -0.6, 0.64);
        for angle in [0.0, 1e-300, 1e-9, 1e-3, 0.05, 0.0999, 0.1001, 1.0, 3.1, 6.0, 500.0] {
            let rotation = axis * angle;
            let exact = start * UnitQuaternion::from_scaled_axis(rotation);
            let turned = turn(&start, &rotation);
            assert!(turned.angle_to(&exact) < 1e-12 * (1.0 + angle), "angle {angle}");
            assert!((turned.norm() - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn world_rotations_are_products_from_the_left() {
        let start = UnitQuaternion::<f64>::from_euler_angles(0.3, -1.1, 2.0);
        let heading = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.7) * start;
        assert!(turn_heading(&start, 0.7).angle_to(&heading) < 1e-15);
        for up in [Vector3::new(3.0, -4.0, 1.0), Vector3::new(1e-9, 0.0, -2.0), Vector3::new(-0.2, 0.1, -5.0)] {
            let upright = turn_upright(&start, &up) * start.inverse();
            assert!((upright * up - Vector3::z() * up.norm()).norm() < 1e-14, "{up}");
            assert!(upright.k.abs() < 1e-15);
        }
        let upright = turn_upright(&start, &-Vector3::z()) * start.inverse();
        assert!((upright * Vector3::z() + Vector3::z()).norm() < 1e-15);
    }

    #[test]
    fn a_turn_by_a_tangent_is_by_twice_its_arc() {
        let start = UnitQuaternion::<f64>::from_euler_angles(0.3, -1.1, 2.0);
        let axis = Vector3::new(0.48, -0.6, 0.64);
        for tangent in [0.0, 1e-9, 0.01, 1.0, 50.0_f64] {
            let exact = start * UnitQuaternion::from_scaled_axis(axis * (2.0 * tangent.atan()));
            let turned = normalised(&turn_by_tangent(&start, &(axis * tangent)));
            assert!(turned.angle_to(&exact) < 1e-14 && (turned.norm() - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn a_little_turn_is_by_its_angle() {
        let start = UnitQuaternion::<f64>::from_euler_angles(0.3, -1.1, 2.0);
        let axis = Vector3::new(0.48, -0.6, 0.64);
        for angle in [0.0, 1e-300, 1e-9, 1e-3, 0.05, 0.0999] {
            let exact = start * UnitQuaternion::from_scaled_axis(axis * angle);
            let turned = turn_little(&start, &(axis * angle), angle * angle);
            assert!((turned.coords - exact.coords).norm() < 1e-13, "angle {angle}");
            assert!((turned.norm() - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn rounding_is_removed() {
        let q = Quaternion::new(0.5, 0.5, -0.5, 0.5) * (1.0 + 1e-9_f64);
        assert!((renormalised(&Unit::new_unchecked(q)).norm() - 1.0).abs() < 1e-15);
    }
}
