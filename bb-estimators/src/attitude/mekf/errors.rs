//! The state of the filter and its covariance.

use nalgebra::{Matrix3, Vector3};

use super::window::Window;
use crate::attitude::Real;

// The first four states are all that a field corrects.

/// Bias of the gyroscope in the body frame, rad/s.
pub(super) const BIAS: [usize; 3] = [0, 1, 2];
/// Rotation error about the vertical, rad.
pub(super) const HEADING: usize = 3;
/// Rotation error in the world, rad. Its value is moved into the orientation at the end of each window.
pub(super) const ROTATION: [usize; 3] = [X, Y, HEADING];
/// Horizontal velocity, m/s.
pub(super) const VELOCITY: [usize; 2] = [EAST, NORTH];

const BY_FIELD: usize = 4;
const X: usize = 4;
const Y: usize = 5;
pub(super) const EAST: usize = 6;
pub(super) const NORTH: usize = 7;

const STATES: usize = 8;

/// Variance below which only rounding errors are left.
const LEAST_VARIANCE: f64 = 1e-16;

/// Values and their covariance.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Errors<T: Real> {
    pub(super) value: [T; STATES],
    /// The upper triangle; the elements below it are zero.
    covariance: [[T; STATES]; STATES],
}

/// Covariances of all states with one quantity.
type Shared<T> = [T; STATES];

impl<T: Real> Errors<T> {
    pub(super) fn new() -> Self {
        Self { value: [T::ZERO; STATES], covariance: [[T::ZERO; STATES]; STATES] }
    }

    #[inline(always)]
    fn at(&self, one: usize, other: usize) -> T {
        self.covariance[one.min(other)][one.max(other)]
    }

    pub(super) fn variance(&self, state: usize) -> T {
        self.covariance[state][state]
    }

    pub(super) fn vector(&self, states: [usize; 3]) -> Vector3<T> {
        states.map(|state| self.value[state]).into()
    }

    /// The covariance of three states.
    pub(super) fn block(&self, states: [usize; 3]) -> Matrix3<T> {
        Matrix3::from_fn(|row, column| self.at(states[row], states[column]))
    }

    /// Root mean square of the standard deviations of the bias along the axes.
    pub(super) fn deviation_of_bias(&self) -> T {
        (BIAS.iter().map(|state| self.variance(*state)).sum::<T>() / T::of(3.0)).sqrt()
    }

    /// Adds to the variance of a state.
    pub(super) fn doubt(&mut self, state: usize, variance: T) {
        self.covariance[state][state] += variance;
    }

    /// Makes states independent of the others, with this variance.
    pub(super) fn forget(&mut self, states: &[usize], variance: T) {
        for &state in states {
            self.covariance[state] = [T::ZERO; STATES];
            for row in &mut self.covariance[..state] {
                row[state] = T::ZERO;
            }
            self.covariance[state][state] = variance;
        }
    }

    /// Moves the rotation error out of the state.
    pub(super) fn take_rotation(&mut self) -> Vector3<T> {
        ROTATION.map(|state| core::mem::replace(&mut self.value[state], T::ZERO)).into()
    }

    /// Propagates over a window: `θ -= ∫R dt b`, `v += ∫R f dt + g_z θ × z`.
    ///
    /// Heading does not enter the velocity: it would let accelerations correct the heading, and through it the bias about
    /// the vertical. `rotation`, rad², and `bias`, (rad/s)², are the variances that are added about each axis.
    pub(super) fn propagate(&mut self, window: &Window<T>, rotation: T, bias: T) {
        self.value[EAST] += window.force.x;
        self.value[NORTH] += window.force.y;
        let (turn, lift) = (&window.rotation, window.force.z);
        // Covariances of the new rotation with the old states.
        let turned: [Shared<T>; 3] = core::array::from_fn(|axis| {
            let mut row = self.shared(ROTATION[axis]);
            for state in BIAS {
                let (of_bias, part) = (self.shared(state), turn[(axis, state)]);
                for (one, other) in row.iter_mut().zip(of_bias) {
                    *one -= part * other;
                }
            }
            row
        });
        let p = &mut self.covariance;
        p[EAST][EAST] += lift * (p[Y][EAST] + p[Y][EAST] + lift * p[Y][Y]);
        p[EAST][NORTH] += lift * (p[Y][NORTH] - p[X][EAST] - lift * p[X][Y]);
        p[NORTH][NORTH] -= lift * (p[X][NORTH] + p[X][NORTH] - lift * p[X][X]);
        for state in BIAS {
            p[state][EAST] += lift * p[state][Y];
            p[state][NORTH] -= lift * p[state][X];
        }
        for (axis, row) in ROTATION.into_iter().enumerate() {
            for state in BIAS {
                p[state][row] = turned[axis][state];
            }
            p[row][EAST] = turned[axis][EAST] + lift * turned[axis][Y];
            p[row][NORTH] = turned[axis][NORTH] - lift * turned[axis][X];
            for (other, column) in ROTATION.into_iter().enumerate() {
                if row <= column {
                    let of_bias = turned[axis][0] * turn[(other, 0)]
                        + turned[axis][1] * turn[(other, 1)]
                        + turned[axis][2] * turn[(other, 2)];
                    p[row][column] = turned[axis][column] - of_bias;
                }
            }
            p[row][row] += rotation;
            p[axis][axis] += bias;
        }
        for (state, row) in p.iter_mut().enumerate() {
            if row[state] < T::of(LEAST_VARIANCE) {
                row[state] = T::of(LEAST_VARIANCE);
            }
        }
    }

    /// Covariances of all states with `state`.
    #[inline(always)]
    fn shared(&self, state: usize) -> Shared<T> {
        core::array::from_fn(|other| self.at(state, other))
    }

    /// Corrects the state by a measurement of state `STATE` with this residual and variance.
    ///
    /// If the vertical `up` is given, in the body frame, the heading and the bias about it are not corrected, as in a Schmidt–Kalman
    /// filter: accelerations carry no information on them, and their errors, which are not white, would corrupt both, which nothing
    /// corrects without a magnetometer.
    #[inline(always)]
    pub(super) fn correct_one<const STATE: usize>(&mut self, residual: T, variance: T, up: Option<&Vector3<T>>) {
        let shared = self.shared(STATE);
        let inverse = self.correct::<STATES>(&shared, shared[STATE] + variance, residual);
        let (Some(inverse), Some(up)) = (inverse, up) else { return };
        let along = up.x * shared[0] + up.y * shared[1] + up.z * shared[2];
        let kept = [(0, up.x * along), (1, up.y * along), (2, up.z * along), (HEADING, shared[HEADING])];
        for (index, (row, part)) in kept.iter().enumerate() {
            self.value[*row] -= *part * inverse * residual;
            for (column, other) in &kept[index..] {
                self.covariance[*row][*column] += *part * inverse * *other;
            }
        }
    }

    /// Corrects the state by the field's angle, with this residual and variance. `slopes` are its derivatives with respect to the
    /// states. Tilt and velocity, which gravity determines better, are not corrected.
    #[inline(always)]
    pub(super) fn correct_by_field<const N: usize>(&mut self, slopes: [(usize, T); N], residual: T, variance: T) {
        let mut shared = [T::ZERO; STATES];
        for (state, slope) in slopes {
            for (one, other) in shared.iter_mut().zip(self.shared(state)) {
                *one += slope * other;
            }
        }
        let expected: T = slopes.iter().map(|(state, slope)| shared[*state] * *slope).sum();
        self.correct::<BY_FIELD>(&shared, expected + variance, residual);
    }

    /// Corrects the first states by a residual of this total variance, and returns the inverse of the variance.
    fn correct<const FIRST: usize>(&mut self, shared: &Shared<T>, total: T, residual: T) -> Option<T> {
        // Rounding, or absurd samples.
        if total <= T::ZERO || !total.is_finite() {
            return None;
        }
        let inverse = T::ONE / total;
        let gain = shared.map(|shared| shared * inverse);
        for (value, gain) in self.value[..FIRST].iter_mut().zip(gain) {
            *value += gain * residual;
        }
        let p = &mut self.covariance;
        subtract_row::<0, T>(p, &gain, shared);
        subtract_row::<1, T>(p, &gain, shared);
        subtract_row::<2, T>(p, &gain, shared);
        subtract_row::<3, T>(p, &gain, shared);
        if FIRST > BY_FIELD {
            subtract_row::<4, T>(p, &gain, shared);
            subtract_row::<5, T>(p, &gain, shared);
            subtract_row::<6, T>(p, &gain, shared);
            subtract_row::<7, T>(p, &gain, shared);
        }
        Some(inverse)
    }
}

/// Subtracts a correction from row `ROW` of a covariance; a constant, so that the loops are unrolled.
#[inline(always)]
fn subtract_row<const ROW: usize, T: Real>(
    covariance: &mut [[T; STATES]; STATES],
    gain: &Shared<T>,
    shared: &Shared<T>,
) {
    for column in ROW..STATES {
        covariance[ROW][column] -= gain[ROW] * shared[column];
    }
}
