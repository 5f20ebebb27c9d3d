//! Trajectory of the drone: sums of sinusoids, along which it accelerates from rest.

use bb_core::nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use std::f64::consts::TAU;

pub(crate) const GRAVITY: f64 = 9.80665;

/// Time of take-off, s, and time until it has reached its speed, s.
const TAKE_OFF: f64 = 3.0;
const SPEEDING_UP: f64 = 8.0;

/// Motion of the drone, in the tangent frame at its origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Motion {
    pub(crate) position: Vector3<f64>,
    pub(crate) acceleration: Vector3<f64>,
    pub(crate) world_from_body: UnitQuaternion<f64>,
}

/// Returns the progress along the way, s at full speed, with both derivatives.
fn progress(t: f64) -> [f64; 3] {
    let s = (t - TAKE_OFF) / SPEEDING_UP;
    if s <= 0.0 {
        return [0.0; 3];
    }
    if s >= 1.0 {
        return [SPEEDING_UP * (s - 0.5), 1.0, 0.0];
    }
    // The smoothstep as speed.
    let speed = s * s * (3.0 - 2.0 * s);
    [SPEEDING_UP * (s * s * s - 0.5 * s * s * s * s), speed, 6.0 * s * (1.0 - s) / SPEEDING_UP]
}

/// Position and both derivatives along the way.
fn way(s: f64) -> [Vector3<f64>; 3] {
    let mut all = [Vector3::new(15.0 * s, 0.0, 0.0), Vector3::new(15.0, 0.0, 0.0), Vector3::zeros()];
    for (axis, amplitude, period) in [(0, 20.0, 23.0), (1, 80.0, 40.0), (1, 8.0, 11.0), (2, 10.0, 31.0)] {
        let w = TAU / period;
        let (sin, cos) = (w * s).sin_cos();
        all[0][axis] += amplitude * sin;
        all[1][axis] += amplitude * w * cos;
        all[2][axis] -= amplitude * w * w * sin;
    }
    all
}

/// The motion at a time, s.
pub(crate) fn motion(t: f64) -> Motion {
    let [s, speed, change] = progress(t);
    let [position, first, second] = way(s);
    let acceleration = second * (speed * speed) + first * change;
    // The thrust points up, and the drone faces its direction of motion.
    let up = (acceleration + Vector3::new(0.0, 0.0, GRAVITY)).normalize();
    let ahead = (first - up * first.dot(&up)).normalize();
    let rotation = Matrix3::from_columns(&[ahead, up.cross(&ahead), up]);
    let world_from_body = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    Motion { position, acceleration, world_from_body }
}

/// Heading at rest, rad.
pub(crate) fn heading() -> f64 {
    let [_, first, _] = way(0.0);
    first.y.atan2(first.x)
}
