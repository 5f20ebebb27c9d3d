//! The nominal state, and the index of each of its errors in the error vector.

use nalgebra::{Matrix2, SVector, Vector2};

use super::arc::arc;
use crate::attitude::MAX_ANGULAR_VELOCITY;
use crate::navigation::covariance::{Covariance, Innovation};
use crate::navigation::layout::Layout;
use crate::navigation::math::{cos, sin, wrapped};
use crate::navigation::numbers::{MOST_ROTATION, MOST_VARIANCE};
use crate::navigation::update::Composed;

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

/// The errors live on SE(2), with axes turned to those of the world: the heading turns the position error. Velocity, bias and scale are
/// those of the body, and their errors add.
impl Composed<STATES> for PlanarEstimate {
    type State = Self;

    const LAYOUT: Layout<STATES> = {
        let mut layout = Layout::EMPTY;
        layout.set((POSITION, 2), MOST_VARIANCE);
        layout.set((HEADING, 1), MOST_ROTATION);
        layout.set((VELOCITY, 2), MOST_VARIANCE);
        layout.set((GYROSCOPE_BIAS, 1), MAX_ANGULAR_VELOCITY * MAX_ANGULAR_VELOCITY);
        // A hundred times the largest deviation that its parameter accepts.
        layout.set((WHEEL_SCALE, 1), 1e4);
        layout
    };

    fn composed(state: &Self, error: &SVector<f64, STATES>) -> Self {
        let mut additive = *error;
        let moved = arc(error[HEADING]).0 * error.fixed_rows::<2>(POSITION);
        additive.fixed_rows_mut::<2>(POSITION).copy_from(&moved);
        state.corrected(&additive)
    }

    #[inline]
    fn transport_jacobian(error: &SVector<f64, STATES>, jacobian: &mut [[f64; STATES]]) {
        let (integral, turned) = transport(error);
        for row in jacobian {
            let position = [row[POSITION], row[POSITION + 1]];
            row[HEADING] += position[0] * turned[0] + position[1] * turned[1];
            for j in 0..2 {
                row[POSITION + j] = position[0] * integral[(0, j)] + position[1] * integral[(1, j)];
            }
        }
    }

    #[inline]
    fn transport_covariance(error: &SVector<f64, STATES>, covariance: &mut Covariance<STATES>) {
        let (integral, turned) = transport(error);
        let moved = |x: f64, y: f64, heading: f64| integral * Vector2::new(x, y) + turned * heading;
        let rows = covariance.rows_mut();
        let [xs, ys, headings, ..] = rows;
        for ((x, y), heading) in xs.iter_mut().zip(ys.iter_mut()).zip(headings) {
            [*x, *y] = moved(*x, *y, *heading).into();
        }
        for row in rows.iter_mut() {
            let [x, y] = moved(row[POSITION], row[POSITION + 1], row[HEADING]).into();
            (row[POSITION], row[POSITION + 1]) = (x, y);
        }
        // Exactly symmetric.
        let [xs, ys, others @ ..] = rows;
        ys[POSITION] = xs[POSITION + 1];
        for (row, (x, y)) in others.iter_mut().zip(xs.iter().zip(ys.iter()).skip(HEADING)) {
            (row[POSITION], row[POSITION + 1]) = (*x, *y);
        }
    }

    /// Only the position is turned by the heading. To iterate what depends on the scale of the wheels would make too much of it: that is
    /// linearised at the velocity that the same reading shows.
    fn curvature(innovation: &Innovation<'_>, covariance: &Covariance<STATES>) -> f64 {
        if Self::fixes_position(innovation) { covariance.matrix()[(HEADING, HEADING)] } else { 0.0 }
    }

    fn fixes_position(innovation: &Innovation<'_>) -> bool {
        innovation.rows(STATES).any(|row| row[POSITION] != 0.0 || row[POSITION + 1] != 0.0)
    }
}

/// The derivatives of the position error of a composed state: with respect to that of the error, and to the heading.
fn transport(error: &SVector<f64, STATES>) -> (Matrix2<f64>, Vector2<f64>) {
    let (integral, by_turn) = arc(error[HEADING]);
    (integral, by_turn * error.fixed_rows::<2>(POSITION))
}
