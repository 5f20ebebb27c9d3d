//! The nominal state, and the index of each of its errors in the error vector.

use nalgebra::{Matrix2, SVector, Vector2};

use crate::navigation::math::{cos, sin, wrapped};

/// Error of the position in the world, m.
pub const POSITION: usize = 0;
/// Error of the heading, rad.
pub const HEADING: usize = 2;
/// Error of the velocity in the body, m/s.
pub const VELOCITY: usize = 3;
/// Error of the gyroscope's bias, rad/s.
pub const GYROSCOPE_BIAS: usize = 5;
/// Error of the wheels' scale.
pub const WHEEL_SCALE: usize = 6;
/// The number of states.
pub const STATES: usize = 7;

/// The state that a planar filter estimates, at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarEstimate {
    /// The instant, nanoseconds since any fixed epoch.
    pub time_ns: i64,
    /// Position of the body's origin in the world, m.
    pub position: Vector2<f64>,
    /// Heading of the body's x axis, from the world's x axis counter-clockwise, within ±π rad.
    pub heading: f64,
    /// Velocity of the body's origin, in the body, x forward, y left, m/s.
    pub velocity: Vector2<f64>,
    /// Bias of the gyroscope: its reading minus the yaw rate, rad/s.
    pub gyroscope_bias: f64,
    /// Scale of the wheels' velocity, less 1: `measured = (1 + s) true`.
    pub wheel_scale: f64,
    /// Yaw rate over the last sample, bias removed, rad/s.
    pub yaw_rate: f64,
}

impl PlanarEstimate {
    /// Rotates body vectors to world vectors.
    pub fn world_from_body(&self) -> Matrix2<f64> {
        let (sin, cos) = (sin(self.heading), cos(self.heading));
        Matrix2::new(cos, -sin, sin, cos)
    }

    /// The velocity of a point of the body, in the body, m/s: `v + ω × l`.
    pub fn velocity_at(&self, lever_arm: &Vector2<f64>) -> Vector2<f64> {
        self.velocity + left(lever_arm) * self.yaw_rate
    }

    /// The estimate with `error` added: the inverse of an error's definition.
    pub fn corrected(&self, error: &SVector<f64, STATES>) -> Self {
        Self {
            time_ns: self.time_ns,
            position: self.position + error.fixed_rows::<2>(POSITION),
            heading: wrapped(self.heading + error[HEADING]),
            velocity: self.velocity + error.fixed_rows::<2>(VELOCITY),
            gyroscope_bias: self.gyroscope_bias + error[GYROSCOPE_BIAS],
            wheel_scale: self.wheel_scale + error[WHEEL_SCALE],
            yaw_rate: self.yaw_rate - error[GYROSCOPE_BIAS],
        }
    }

    /// The error that takes this estimate to `other`: `self.corrected(&self.error_to(&other))` is `other`, except for its stamp
    /// and yaw rate.
    pub fn error_to(&self, other: &Self) -> SVector<f64, STATES> {
        let mut error = SVector::<f64, STATES>::zeros();
        error.fixed_rows_mut::<2>(POSITION).copy_from(&(other.position - self.position));
        error[HEADING] = wrapped(other.heading - self.heading);
        error.fixed_rows_mut::<2>(VELOCITY).copy_from(&(other.velocity - self.velocity));
        error[GYROSCOPE_BIAS] = other.gyroscope_bias - self.gyroscope_bias;
        error[WHEEL_SCALE] = other.wheel_scale - self.wheel_scale;
        error
    }

    pub(super) fn is_finite(&self) -> bool {
        self.position.iter().chain(self.velocity.iter()).all(|x| x.is_finite())
            && self.heading.is_finite()
            && self.gyroscope_bias.is_finite()
            && self.wheel_scale.is_finite()
    }
}

/// A vector rotated by 90° counter-clockwise: its derivative with respect to its angle.
pub(super) fn left(vector: &Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-vector.y, vector.x)
}
