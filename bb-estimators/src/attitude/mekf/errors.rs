//! The state of the filter: what it estimates, with its covariance.

use nalgebra::{Matrix3, Vector3};

use super::window::Window;
use crate::attitude::Real;

/// Rotation error in the world, rad. Its value is moved into the orientation at the end of each window.
pub(super) const ROTATION: usize = 0;
/// About the vertical.
pub(super) const HEADING: usize = ROTATION + 2;
/// Bias of the gyroscope in the body frame, rad/s.
pub(super) const BIAS: usize = 3;
/// Horizontal velocity, m/s.
pub(super) const VELOCITY: usize = 6;
/// Lag of the magnetometer behind the gyroscope, s.
pub(super) const LAG: usize = 8;

const STATES: usize = 9;

/// A smaller variance is rounding.
const LEAST_VARIANCE: f64 = 1e-16;

/// Values and their covariance.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Errors<T: Real> {
    pub(super) value: [T; STATES],
    covariance: [[T; STATES]; STATES],
}

/// Variances that a window adds.
pub(super) struct ProcessNoise<T> {
    /// About each axis, rad².
    pub(super) rotation: T,
    /// (rad/s)².
    pub(super) bias: T,
}

impl<T: Real> Errors<T> {
    pub(super) fn new() -> Self {
        Self { value: [T::ZERO; STATES], covariance: [[T::ZERO; STATES]; STATES] }
    }

    pub(super) fn variance(&self, state: usize) -> T {
        self.covariance[state][state]
    }

    pub(super) fn vector(&self, first: usize) -> Vector3<T> {
        Vector3::new(self.value[first], self.value[first + 1], self.value[first + 2])
    }

    /// The covariance of three states.
    pub(super) fn block(&self, first: usize) -> Matrix3<T> {
        Matrix3::from_fn(|row, column| self.covariance[first + row][first + column])
    }

    /// Adds to the variance of a state.
    pub(super) fn doubt(&mut self, state: usize, variance: T) {
        self.covariance[state][state] += variance;
    }

    /// Makes states independent of the others, with this variance.
    pub(super) fn forget(&mut self, states: core::ops::Range<usize>, variance: T) {
        for state in states {
            for other in 0..STATES {
                self.covariance[state][other] = T::ZERO;
                self.covariance[other][state] = T::ZERO;
            }
            self.covariance[state][state] = variance;
        }
    }

    /// Moves the rotation error out of the state.
    pub(super) fn take_rotation(&mut self) -> Vector3<T> {
        let rotation = self.vector(ROTATION);
        self.value[ROTATION..ROTATION + 3].fill(T::ZERO);
        rotation
    }

    /// Propagates over a window: `θ -= ∫R dt b`, `v += ∫R f dt + g_z θ × z`.
    ///
    /// Heading does not enter the velocity: it would let accelerations correct the heading, and through it the bias about
    /// the vertical.
    pub(super) fn propagate(&mut self, window: &Window<T>, noise: &ProcessNoise<T>) {
        self.value[VELOCITY] += window.force.x;
        self.value[VELOCITY + 1] += window.force.y;
        let (turn, lift) = (&window.rotation, window.force.z);
        // From the left and, the matrix being symmetric, from the right: rows and columns in turn.
        for is_column in [false, true] {
            for other in 0..STATES {
                let at = |state: usize| {
                    if is_column { self.covariance[other][state] } else { self.covariance[state][other] }
                };
                let bias = Vector3::new(at(BIAS), at(BIAS + 1), at(BIAS + 2));
                let rotation = Vector3::new(at(ROTATION), at(ROTATION + 1), at(ROTATION + 2)) - turn * bias;
                let east = at(VELOCITY) + lift * at(ROTATION + 1);
                let north = at(VELOCITY + 1) - lift * at(ROTATION);
                let mut set = |state: usize, value| {
                    let (row, column) = if is_column { (other, state) } else { (state, other) };
                    self.covariance[row][column] = value;
                };
                set(ROTATION, rotation.x);
                set(ROTATION + 1, rotation.y);
                set(ROTATION + 2, rotation.z);
                set(VELOCITY, east);
                set(VELOCITY + 1, north);
            }
        }
        for axis in 0..3 {
            self.doubt(ROTATION + axis, noise.rotation);
            self.doubt(BIAS + axis, noise.bias);
        }
        for row in 1..STATES {
            for column in 0..row {
                let mean = T::HALF * (self.covariance[row][column] + self.covariance[column][row]);
                self.covariance[row][column] = mean;
                self.covariance[column][row] = mean;
            }
        }
    }

    /// Corrects the state by a scalar that depends on it by `slopes`: by how much it is more than expected, with which
    /// variance.
    ///
    /// `kept` returns states that are left alone, as in a Schmidt–Kalman filter, with the part of their covariance with the
    /// scalar that is: for a scalar whose error is not white, or which others know better.
    pub(super) fn correct<const N: usize, const K: usize>(
        &mut self,
        slopes: [(usize, T); N],
        residual: T,
        variance: T,
        kept: impl Fn(&[T; STATES]) -> [(usize, T); K],
    ) {
        let mut shared = [T::ZERO; STATES];
        for (one, row) in shared.iter_mut().zip(&self.covariance) {
            *one = slopes.iter().map(|(state, slope)| row[*state] * *slope).sum();
        }
        let expected: T = slopes.iter().map(|(state, slope)| shared[*state] * *slope).sum();
        let total = expected + variance;
        // Rounding, or absurd samples.
        if total <= T::ZERO || !total.is_finite() {
            return;
        }
        let inverse = T::ONE / total;
        for row in 0..STATES {
            let gain = shared[row] * inverse;
            self.value[row] += gain * residual;
            #[expect(
                clippy::needless_range_loop,
                reason = "an iterator costs a tenth of the filter's instructions"
            )]
            for column in row..STATES {
                let covariance = self.covariance[row][column] - gain * shared[column];
                self.covariance[row][column] = covariance;
                self.covariance[column][row] = covariance;
            }
        }
        let kept = kept(&shared);
        for (index, (row, part)) in kept.iter().enumerate() {
            let gain = *part * inverse;
            self.value[*row] -= gain * residual;
            for (column, other) in &kept[index..] {
                let covariance = self.covariance[*row][*column] + gain * *other;
                self.covariance[*row][*column] = covariance;
                self.covariance[*column][*row] = covariance;
            }
        }
        for (state, row) in self.covariance.iter_mut().enumerate() {
            row[state] = row[state].max(T::of(LEAST_VARIANCE));
        }
    }
}

/// Leaves nothing alone.
pub(super) fn nothing<T: Real>(_: &[T; STATES]) -> [(usize, T); 0] {
    []
}

/// Leaves tilt and velocity alone, which gravity knows better than a field.
pub(super) fn tilt_and_velocity<T: Real>(shared: &[T; STATES]) -> [(usize, T); 4] {
    [ROTATION, ROTATION + 1, VELOCITY, VELOCITY + 1].map(|state| (state, shared[state]))
}

/// Leaves the heading and the bias about the vertical alone, given in the body frame. Accelerations tell nothing of them
/// but by their errors, which are not white, and without a magnetometer nothing would mend that.
pub(super) fn about_vertical<T: Real>(up: &Vector3<T>, shared: &[T; STATES]) -> [(usize, T); 4] {
    let along = up.x * shared[BIAS] + up.y * shared[BIAS + 1] + up.z * shared[BIAS + 2];
    [(HEADING, shared[HEADING]), (BIAS, up.x * along), (BIAS + 1, up.y * along), (BIAS + 2, up.z * along)]
}
