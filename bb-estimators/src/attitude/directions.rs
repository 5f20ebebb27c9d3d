//! The deviation of an orientation from the measured directions of gravity and field.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::Real;

/// The small turn of the body, rad, body frame, that would bring the expected directions onto the measured ones,
/// and the expected vertical in the body frame.
///
/// The turn is `e = a × Rᵀẑ + m × Rᵀb`, with the measured unit vectors `a` and `m`, `R` taking body to world, and
/// the field's reference `b = (0, √(h_x² + h_y²), h_z)`, `h = R m`: the measured field itself, its horizontal part
/// turned north. Source: section 3.4 of Madgwick's report for `b`; equation (32c) of Mahony, Hamel, Pflimlin for e.
///
/// `world_from_body` may have any norm, the square of which is `norm`: the vertical is then that times as long, and the turn
/// with a field the square of that.
#[inline]
pub(super) fn misalignment<T: Real>(
    world_from_body: &Quaternion<T>,
    norm: T,
    up: &Vector3<T>,
    field: Option<&Vector3<T>>,
) -> (Vector3<T>, Vector3<T>) {
    let (w, x, y, z) = (world_from_body.w, world_from_body.i, world_from_body.j, world_from_body.k);
    let (x2, y2, z2) = (x + x, y + y, z + z);
    let (wx, wy, xx, xz, yy, yz) = (w * x2, w * y2, x * x2, x * z2, y * y2, y * z2);
    // Rᵀẑ, the third row of R.
    let world_up = Vector3::new(xz - wy, yz + wx, norm - xx - yy);
    let Some(field) = field else {
        return (up.cross(&world_up), world_up);
    };
    let (wz, xy, zz) = (w * z2, x * y2, z * z2);
    let world_north = Vector3::new(xy + wz, norm - xx - zz, yz - wx);
    let vertical = world_up.dot(field);
    // The field is a unit vector up to rounding, and the vertical as long as `norm`.
    let squared = norm * norm - vertical * vertical;
    let horizontal = if squared > T::ZERO { squared.sqrt() } else { T::ZERO };
    // a × Rᵀẑ + m × (b_n Rᵀŷ + b_z Rᵀẑ), with the products by Rᵀẑ in one.
    let error = (up * norm + field * vertical).cross(&world_up) + field.cross(&(world_north * horizontal));
    (error, world_up)
}

/// A unit vector, body frame, perpendicular to the expected vertical. A body that is exactly upside down, where the
/// misalignment is zero, is turned upright about it.
#[cold]
pub(super) fn horizontal_axis<T: Real>(world_up: Vector3<T>) -> Vector3<T> {
    let axis = if world_up.x.abs() < T::HALF { Vector3::x() } else { Vector3::y() };
    axis.cross(&world_up).normalize()
}

/// East and up as expected in the body frame: the first and third row of R.
#[inline]
pub(super) fn expected<T: Real>(world_from_body: &UnitQuaternion<T>) -> [Vector3<T>; 2] {
    let (w, x, y, z) = (world_from_body.w, world_from_body.i, world_from_body.j, world_from_body.k);
    let (x2, y2, z2) = (x + x, y + y, z + z);
    let (xx, yy, zz, xy, xz, yz) = (x * x2, y * y2, z * z2, x * y2, x * z2, y * z2);
    let (wx, wy, wz) = (w * x2, w * y2, w * z2);
    [Vector3::new(T::ONE - yy - zz, xy - wz, xz + wy), Vector3::new(xz - wy, yz + wx, T::ONE - xx - yy)]
}

/// Returns the direction of up expected in the body frame, times the squared norm of `world_from_body`, which may be any.
#[inline]
pub(super) fn expected_up<T: Real>(world_from_body: &Quaternion<T>) -> Vector3<T> {
    let (w, x, y, z) = (world_from_body.w, world_from_body.i, world_from_body.j, world_from_body.k);
    let (x2, y2) = (x + x, y + y);
    Vector3::new(x2 * z - w * y2, y2 * z + w * x2, (w * w + z * z) - (x * x + y * y))
}
