//! The link between a keyframe and the previous one: the IMU between them, and relative poses.
//!
//! The link is stored backwards in time, as `δ_before = G δ + g + ν` with noise ν of covariance Q, together with its
//! information on the later keyframe alone. The noise of the IMU is therefore never inverted. No digits are lost after
//! a millisecond between two keyframes, which determines almost everything, nor after a minute, which determines almost
//! nothing. A factor on both keyframes is a measurement of ν: it updates G, g and Q like a Kalman filter. The rest is
//! information on the later keyframe alone.

#![allow(clippy::needless_range_loop, reason = "the indices are those of the equations")]

use nalgebra::{Matrix3, Vector3};

use super::matrix::{Square, add_gram, axpy, dot, times, zeros};
use super::preintegration::Preintegration;
use crate::navigation::eskf::{EskfParams, ImuDensities, Transition, rows};
use crate::navigation::factor::{MOST_ROWS, Rows};
use crate::navigation::math::{Integrals, exp, renormalised, rotation, skew, sqrt};
use crate::navigation::numbers::LEAST_KEPT;
use crate::navigation::state::{
    ACCELEROMETER_BIAS, Estimate, GYROSCOPE_BIAS, POSITION, ROTATION, States, VELOCITY, offset,
};

/// Information on a state in least-squares form: the cost `½ δᵀ M δ - vᵀ δ`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Information<const N: usize> {
    /// M, on and above the diagonal.
    pub(super) matrix: Square<N>,
    pub(super) vector: [f64; N],
}

impl<const N: usize> Information<N> {
    pub(super) const fn none() -> Self {
        Self { matrix: zeros(), vector: [0.0; N] }
    }

    pub(super) fn add(&mut self, other: &Self) {
        for i in 0..N {
            axpy(&mut self.matrix[i], 1.0, &other.matrix[i]);
        }
        axpy(&mut self.vector, 1.0, &other.vector);
    }

    /// Adds rows of variance 1: `residual = H δ + noise`.
    #[inline]
    pub(super) fn add_rows(&mut self, rows: &[[f64; N]], residual: &[f64]) {
        add_gram(&mut self.matrix, rows);
        for (row, residual) in rows.iter().zip(residual) {
            axpy(&mut self.vector, *residual, row);
        }
    }
}

/// The link between a keyframe and the previous one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Link<const N: usize> {
    /// G.
    pub(super) back: Square<N>,
    /// g.
    pub(super) offset: [f64; N],
    /// Q.
    pub(super) noise: Square<N>,
    /// The information on the later keyframe alone.
    pub(super) information: Information<N>,
}

/// Predicts the body's state after the motion from its state at `from`.
pub(super) fn predicted<S: States, const N: usize>(
    from: &Estimate<N>,
    motion: &Preintegration,
    params: &EskfParams,
) -> Estimate<N> {
    let corrected = Corrected::new(from, motion);
    let seconds = motion.seconds();
    let fall = Vector3::new(0.0, 0.0, -params.gravity * seconds);
    let mut to = *from;
    to.position += from.velocity * seconds + from.world_from_body * corrected.position + fall * (0.5 * seconds);
    to.velocity += from.world_from_body * corrected.velocity + fall;
    to.world_from_body = renormalised(&(from.world_from_body * corrected.rotation));
    for (index, kept, _) in wandering::<S>(seconds, params) {
        to.optional[index] *= kept;
    }
    to
}

/// The motion, corrected to the biases of an estimate.
struct Corrected {
    position: Vector3<f64>,
    velocity: Vector3<f64>,
    rotation: nalgebra::UnitQuaternion<f64>,
    /// Derivative of the rotation with respect to the gyroscope's bias.
    rotation_by_gyroscope: Matrix3<f64>,
}

impl Corrected {
    /// C. Forster et al., equation 44, with the rotation's part on the left.
    fn new<const N: usize>(at: &Estimate<N>, motion: &Preintegration) -> Self {
        let accelerometer = at.accelerometer_bias - motion.accelerometer_bias();
        let gyroscope = at.gyroscope_bias - motion.gyroscope_bias();
        let (by_accelerometer, by_gyroscope) = (&motion.by_accelerometer, &motion.by_gyroscope);
        let turn = by_gyroscope.rotation * gyroscope;
        Self {
            position: motion.position()
                + by_accelerometer.position * accelerometer
                + by_gyroscope.position * gyroscope,
            velocity: motion.velocity()
                + by_accelerometer.velocity * accelerometer
                + by_gyroscope.velocity * gyroscope,
            rotation: rotation(&turn) * motion.rotation(),
            rotation_by_gyroscope: Integrals::new(&turn).first_matrix(&turn) * by_gyroscope.rotation,
        }
    }
}

/// The optional states: their index, the fraction that they keep over a time, and the variance that they gain.
fn wandering<S: States>(seconds: f64, params: &EskfParams) -> impl Iterator<Item = (usize, f64, f64)> {
    S::OPTIONAL.iter().flat_map(move |state| {
        let process = params.process(*state);
        let (kept, gained) = process.map_or((1.0, 0.0), |process| {
            let kept = exp(-seconds / process.time_s).max(LEAST_KEPT);
            (kept, process.deviation * process.deviation * (1.0 - kept * kept))
        });
        let first = offset::<S>(*state).unwrap_or(0);
        (first..first + state.dimension()).map(move |index| (index, kept, gained))
    })
}

impl<const N: usize> Link<N> {
    pub(super) const fn none() -> Self {
        Self { back: zeros(), offset: [0.0; N], noise: zeros(), information: Information::none() }
    }

    /// The link by the motion, linearised about these estimates.
    ///
    /// The derivatives of position and velocity with respect to rotation are taken from the estimates, not from the
    /// measured motion. Rotating and moving the whole world, which no IMU observes, then changes nothing here either,
    /// and noise yields no information about heading. G. Huang, A. Mourikis, S. Roumeliotis, "Observability-based rules
    /// for designing consistent EKF SLAM estimators", The International Journal of Robotics Research 29(5), 2010.
    pub(super) fn of_motion<S: States>(
        from: &Estimate<N>,
        to: &Estimate<N>,
        motion: &Preintegration,
        params: &EskfParams,
    ) -> Self {
        let corrected = Corrected::new(from, motion);
        let seconds = motion.seconds();
        let predicted = predicted::<S, N>(from, motion, params);

        // In the axes of the body at `from`: the inverse of the transition in `preintegration.rs`.
        let to_world = from.rotation();
        let fall = Vector3::new(0.0, 0.0, -params.gravity * seconds);
        let gained = to.velocity - from.velocity - fall;
        let moved = to.position - from.position - from.velocity * seconds - fall * (0.5 * seconds);
        let (velocity, position) = (skew(&to_world.tr_mul(&gained)), skew(&to_world.tr_mul(&moved)));
        let turned = corrected.rotation_by_gyroscope;
        let (by_accelerometer, by_gyroscope) = (&motion.by_accelerometer, &motion.by_gyroscope);
        let position_by_rotation = position - velocity * seconds;
        let velocity_by_gyroscope = -by_gyroscope.velocity - velocity * turned;
        let position_by_gyroscope =
            -by_gyroscope.position + by_gyroscope.velocity * seconds - position_by_rotation * turned;
        let position_by_accelerometer = by_accelerometer.velocity * seconds - by_accelerometer.position;
        let inverse = Transition {
            dt: -seconds,
            position: rows(&position_by_rotation, &position_by_accelerometer, &position_by_gyroscope),
            velocity: rows(&velocity, &-by_accelerometer.velocity, &velocity_by_gyroscope),
            rotation: core::array::from_fn(|i| core::array::from_fn(|k| -turned[(i, k)])),
        };
        let mut noise = zeros();
        motion.write_covariance(&mut noise);
        const NONE: ImuDensities =
            ImuDensities { accelerometer: 0.0, gyroscope: 0.0, accelerometer_bias: 0.0, gyroscope_bias: 0.0 };
        inverse.apply(&mut noise, &NONE);
        rotate(&mut noise, &to_world);

        // The same in the world's axes.
        let error = to.error_to::<S>(&predicted);
        let in_world = |block: &Matrix3<f64>| to_world * block * to_world.transpose();
        let mut back = zeros();
        for i in 0..N {
            back[i][i] = 1.0;
        }
        for i in 0..3 {
            back[POSITION + i][VELOCITY + i] = -seconds;
        }
        let mut set = |row: usize, column: usize, block: &Matrix3<f64>| {
            for i in 0..3 {
                for j in 0..3 {
                    back[row + i][column + j] = block[(i, j)];
                }
            }
        };
        set(POSITION, ROTATION, &in_world(&position_by_rotation));
        set(VELOCITY, ROTATION, &in_world(&velocity));
        set(POSITION, ACCELEROMETER_BIAS, &(to_world * position_by_accelerometer));
        set(VELOCITY, ACCELEROMETER_BIAS, &-(to_world * by_accelerometer.velocity));
        set(POSITION, GYROSCOPE_BIAS, &(to_world * position_by_gyroscope));
        set(VELOCITY, GYROSCOPE_BIAS, &(to_world * velocity_by_gyroscope));
        set(ROTATION, GYROSCOPE_BIAS, &-(to_world * turned));

        for (index, kept, gained) in wandering::<S>(seconds, params) {
            back[index][index] = 1.0 / kept;
            noise[index][index] = gained / (kept * kept);
        }
        let error: [f64; N] = core::array::from_fn(|i| -error[i]);
        Self { offset: times(&back, &error), back, noise, information: Information::none() }
    }

    /// Adds a factor on both keyframes.
    #[inline]
    pub(super) fn add(&mut self, factor: &Rows<N>) {
        let mut innovation = self.innovation(factor);
        let count = factor.count;
        // Q Aᵀ; its rows and all other terms are then divided by the Cholesky factor of the innovation covariance.
        let Innovation { projected, expected, residual, covariance } = &mut innovation;
        for i in 0..count {
            for j in 0..i {
                let mut sum = covariance[i][j];
                for k in 0..j {
                    sum -= covariance[i][k] * covariance[j][k];
                }
                let share = sum * covariance[j][j];
                covariance[i][j] = share;
                covariance[i][i] -= share * share;
                let (above, below) = projected.split_at_mut(i);
                axpy(&mut below[0], -share, &above[j]);
                let (above, below) = expected.split_at_mut(i);
                axpy(&mut below[0], -share, &above[j]);
                residual[i] -= share * residual[j];
            }
            // At least the noise of the factor, which is 1.
            let reciprocal = 1.0 / sqrt(covariance[i][i].max(1.0));
            covariance[i][i] = reciprocal;
            projected[i].iter_mut().for_each(|x| *x *= reciprocal);
            expected[i].iter_mut().for_each(|x| *x *= reciprocal);
            residual[i] *= reciprocal;
        }
        for row in 0..count {
            for i in 0..N {
                let gain = projected[row][i];
                axpy(&mut self.back[i], -gain, &expected[row]);
                axpy(&mut self.noise[i], -gain, &projected[row]);
                self.offset[i] += gain * residual[row];
            }
        }
        self.information.add_rows(&expected[..count], &residual[..count]);
    }

    /// Rewrites the factor in ν: with `A δ_before + B δ = residual + noise`, it is `A ν = residual' - (A G + B) δ`.
    #[inline]
    pub(super) fn innovation(&self, factor: &Rows<N>) -> Innovation<N> {
        let mut all = Innovation {
            projected: [[0.0; N]; MOST_ROWS],
            expected: factor.at,
            residual: factor.residual,
            covariance: [[0.0; MOST_ROWS]; MOST_ROWS],
        };
        for row in 0..factor.count {
            let jacobian = &factor.previous[row];
            for k in 0..N {
                if jacobian[k] != 0.0 {
                    axpy(&mut all.projected[row], jacobian[k], &self.noise[k]);
                    axpy(&mut all.expected[row], jacobian[k], &self.back[k]);
                }
            }
            all.residual[row] -= dot(jacobian, &self.offset);
            for column in 0..=row {
                all.covariance[row][column] = dot(&all.projected[row], &factor.previous[column]);
            }
            all.covariance[row][row] += 1.0;
        }
        all
    }
}

/// A factor on both keyframes as a measurement of the noise between them.
pub(super) struct Innovation<const N: usize> {
    /// `A Q`.
    pub(super) projected: [[f64; N]; MOST_ROWS],
    /// `A G + B`.
    pub(super) expected: [[f64; N]; MOST_ROWS],
    /// `residual - A g`.
    pub(super) residual: [f64; MOST_ROWS],
    /// `A Q Aᵀ + I`, on and below the diagonal.
    pub(super) covariance: [[f64; MOST_ROWS]; MOST_ROWS],
}

/// `T M Tᵀ` of a symmetric matrix that holds only navigation states so far. T applies the rotation to position,
/// velocity and rotation.
fn rotate<const N: usize>(matrix: &mut Square<N>, rotation: &Matrix3<f64>) {
    const TURNED: [usize; 3] = [POSITION, VELOCITY, ROTATION];
    let block =
        |matrix: &Square<N>, row: usize, column: usize| Matrix3::from_fn(|i, j| matrix[row + i][column + j]);
    let set = |matrix: &mut Square<N>, row: usize, column: usize, block: &Matrix3<f64>| {
        for i in 0..3 {
            for j in 0..3 {
                matrix[row + i][column + j] = block[(i, j)];
                matrix[column + j][row + i] = block[(i, j)];
            }
        }
    };
    for (at, row) in TURNED.into_iter().enumerate() {
        for column in TURNED.into_iter().skip(at) {
            let turned = rotation * block(matrix, row, column) * rotation.transpose();
            set(matrix, row, column, &turned);
        }
        for column in [ACCELEROMETER_BIAS, GYROSCOPE_BIAS] {
            let turned = rotation * block(matrix, row, column);
            set(matrix, row, column, &turned);
        }
    }
}
