//! Converts between the axes of MAVLink and those of the framework.
//!
//! | | MAVLink | here |
//! |---|---|---|
//! | world | north, east, down | east, north, up |
//! | body | forward, right, down | forward, left, up |
//!
//! Both conversions are half turns: the world about the horizontal axis to the north-east, the body about the forward
//! axis. So each is its own inverse.

use bb_core::nalgebra::{Matrix3, Matrix6, Quaternion, UnitQuaternion, Vector3};
use std::f64::consts::FRAC_1_SQRT_2;

/// East, north, up from north, east, down, and back.
pub(crate) fn swap_world(vector: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(vector.y, vector.x, -vector.z)
}

/// Forward, left, up from forward, right, down, and back.
pub(crate) fn swap_body(vector: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(vector.x, -vector.y, -vector.z)
}

/// `world_from_body` from the rotation from forward, right, down to north, east, down.
pub(crate) fn world_from_body(ned_from_frd: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    world_half_turn() * ned_from_frd * body_half_turn()
}

/// The rotation from forward, right, down to north, east, down, from `world_from_body`.
pub(crate) fn ned_from_frd(world_from_body: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    world_half_turn() * world_from_body * body_half_turn()
}

fn world_half_turn() -> UnitQuaternion<f64> {
    UnitQuaternion::new_unchecked(Quaternion::new(0.0, FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0))
}

fn body_half_turn() -> UnitQuaternion<f64> {
    UnitQuaternion::new_unchecked(Quaternion::new(0.0, 1.0, 0.0, 0.0))
}

/// `world_half_turn` as a matrix.
pub(crate) fn world_matrix() -> Matrix3<f64> {
    Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0)
}

/// `body_half_turn` as a matrix.
pub(crate) fn body_matrix() -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0))
}

/// The covariance of `first · a` and `second · b`, from that of `a` and `b`.
pub(crate) fn turned(covariance: &Matrix6<f64>, first: &Matrix3<f64>, second: &Matrix3<f64>) -> Matrix6<f64> {
    let mut turn = Matrix6::zeros();
    turn.fixed_view_mut::<3, 3>(0, 0).copy_from(first);
    turn.fixed_view_mut::<3, 3>(3, 3).copy_from(second);
    turn * covariance * turn.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;
    use bb_tests::laws;
    use proptest::prelude::*;

    fn vectors() -> impl Strategy<Value = Vector3<f64>> {
        (-1e6..1e6, -1e6..1e6, -1e6..1e6_f64).prop_map(|(x, y, z)| Vector3::new(x, y, z))
    }

    fn rotations() -> impl Strategy<Value = UnitQuaternion<f64>> {
        (-3.0..3.0, -3.0..3.0, -3.0..3.0_f64)
            .prop_map(|(x, y, z)| UnitQuaternion::from_scaled_axis(Vector3::new(x, y, z)))
    }

    laws! {
        #[test]
        fn vectors_come_back(vector in vectors()) {
            prop_assert_eq!(swap_world(&swap_world(&vector)), vector);
            prop_assert_eq!(swap_body(&swap_body(&vector)), vector);
            prop_assert_eq!(world_matrix() * vector, swap_world(&vector));
            prop_assert_eq!(body_matrix() * vector, swap_body(&vector));
        }

        #[test]
        fn rotations_come_back(rotation in rotations()) {
            prop_assert!(ned_from_frd(&world_from_body(&rotation)).angle_to(&rotation) < 1e-7);
        }

        /// Body vectors are the same in the world in both conventions of axes.
        #[test]
        fn rotations_agree_with_vectors(ned_from_frd in rotations(), frd in vectors()) {
            let by_ned = swap_world(&(ned_from_frd * frd));
            let by_enu = world_from_body(&ned_from_frd) * swap_body(&frd);
            prop_assert!((by_ned - by_enu).norm() <= 1e-14 * frd.norm() * 100.0);
        }
    }

    #[test]
    fn level_and_facing_north_is_a_quarter_turn_from_east() {
        let world_from_body = world_from_body(&UnitQuaternion::identity());
        let forward = world_from_body * Vector3::x();
        let left = world_from_body * Vector3::y();
        assert!((forward - Vector3::y()).norm() < 1e-15, "forward is north: {forward}");
        assert!((left + Vector3::x()).norm() < 1e-15, "left is west: {left}");
    }
}
