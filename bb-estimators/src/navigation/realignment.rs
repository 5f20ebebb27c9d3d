//! Attitude, position and velocity after an outage of the IMU, from the motion since and from positions and velocities in the world,
//! without a linearisation.
//!
//! A Kalman filter corrects the attitude linearly. That is right while the attitude is known to a fraction of a radian. After an outage of
//! seconds it is not known at all: a filter then takes the first corrections for exact, its covariance shrinks as if they were, and it may
//! converge to an attitude that is wrong.
//!
//! # The problem
//!
//! The IMU samples since the end of the outage are preintegrated: at the time t after it they give the rotation `C`, the velocity `α` and
//! the position `β` in the axes of the body at its end, without gravity and initial velocity. With the attitude `R₀`, the position
//! `p₀` and the velocity `v₀` at the end of the outage,
//!
//! * a position of an antenna at l in the body: `z - ½ g t² = p₀ + v₀ t + R₀ (β + C l)`
//! * a velocity of the antenna: `w - g t = v₀ + R₀ (α + C (ω × l))`.
//!
//! Both have the form `y = p₀ f₁ + v₀ f₂ + R₀ m`, with `(f₁, f₂)` of `(1, t)` or `(0, 1)`, for a measured y and a vector m of the body. They
//! are linear in p₀ and v₀. What is left when these are eliminated is Wahba's problem, whose solution is the polar factor of `Σ w ỹ m̃ᵀ`, by
//! its singular value decomposition: the best of all attitudes, not only of those near a first guess. G. Wahba, "A least squares estimate
//! of satellite attitude", SIAM Review 7(3), 1965; F. L. Markley, "Attitude determination using vector observations and the singular value
//! decomposition", Journal of the Astronautical Sciences 36(3), 1988; for the alignment in motion, M. Wu et al., "Optimization-based
//! alignment for inertial navigation systems", arXiv 1011.1180, 2010.
//!
//! The biases of the IMU are not known exactly: `m = m̂ + J b` with the derivatives J of the preintegration and the covariance of b from before
//! the outage. From Wahba's solution on, Gauss–Newton steps solve for all 15 errors `x = (φ, P, V, b)`, with `R₀ ← R₀ exp(φ)`, `P = R₀ᵀ p₀` and
//! `V = R₀ᵀ v₀`:
//!
//! `R₀ᵀ y - m̂ = G x + noise`, `G = (-[m̂]×, f₁ I, f₂ I, J)`.
//!
//! G depends neither on the attitude nor on what was measured. The information matrix `Σ w Gᵀ G` is therefore the same for all attitudes, and noise
//! of the measurements does not count as information: without a horizontal acceleration, the heading remains unknown. It is a sum, as are
//! `Σ w Gᵀ y`, `Σ w Gᵀ m̂` and the squares, so the memory does not grow with the number of measurements.
//!
//! # Noise
//!
//! In the axes of the body, noise of different variances in different directions would depend on the attitude. Each measurement is given the
//! largest variance of all directions, and the variance that the noise of the IMU has made of the motion until then: the covariance
//! of the result is not too small. The noise of the IMU since the outage is added to the result as a whole.
//!
//! The weighted sum of the squared residuals follows a χ² distribution with as many degrees of freedom as there are components, less the
//! nine of attitude, position and velocity. A sum that is too large shows an outlier: the measurements are dropped, and the
//! caller begins again.

use nalgebra::linalg::{Cholesky, SVD};
use nalgebra::{Matrix3, Rotation3, SMatrix, SVector, UnitQuaternion, Vector3};

use super::eskf::{EskfParams, ImuDensities, ImuMean, seconds_between};
use super::math::{renormalised, rotation, skew, sqrt};
use super::measurement::{GnssPosition, GnssVelocity};
use super::smoother::Preintegration;
use super::state::{ACCELEROMETER_BIAS, Estimate, GYROSCOPE_BIAS, NAVIGATION, POSITION, ROTATION, VELOCITY};

#[cfg(test)]
mod tests;

/// A rotation known to this deviation, rad, summed over its axes, can be corrected linearly. Over 400 flights with random attitudes, the
/// normalised squared error of position, velocity and attitude is then 8.6 of 9 with velocities and 9.0 with positions alone, which take
/// longer and bend more; at 0.2 rad, 8.7 and 10.3.
pub(in crate::navigation) const KNOWN: f64 = 0.15;

/// The longest motion, s. After a longer one, the noise of the gyroscope outweighs that of the measurements.
const LONGEST_S: f64 = 40.0;

/// Quantile of the standard normal distribution that the residuals may reach.
const MOST_MISFIT: f64 = 4.0;

/// Number of Gauss–Newton steps. Each reduces the error by the ratio of noise to motion.
const STEPS: usize = 20;

/// A step below this angle, rad, is the last.
const CONVERGED: f64 = 1e-7;

/// Order of the errors at the end of the outage.
const TURN: usize = 0;
const PLACE: usize = 3;
const SPEED: usize = 6;
const BIASES: usize = 9;

/// Why a set of measurements was dropped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::navigation) enum Dropped {
    /// They do not fit each other.
    Misfit,
    /// The IMU was not trusted for so long.
    TooLong,
}

/// The state after an outage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::navigation) struct Realigned {
    pub(in crate::navigation) position: Vector3<f64>,
    pub(in crate::navigation) velocity: Vector3<f64>,
    pub(in crate::navigation) world_from_body: UnitQuaternion<f64>,
    pub(in crate::navigation) accelerometer_bias: Vector3<f64>,
    pub(in crate::navigation) gyroscope_bias: Vector3<f64>,
    /// In the order of [`POSITION`] to [`GYROSCOPE_BIAS`].
    pub(in crate::navigation) covariance: SMatrix<f64, NAVIGATION, NAVIGATION>,
}

/// The sums; see the [module](self).
#[derive(Clone, Debug)]
pub(in crate::navigation) struct Realignment {
    now_ns: i64,
    /// Positions are relative to this one.
    origin: Vector3<f64>,
    gravity: f64,
    densities: ImuDensities,
    motion: Preintegration,
    angular_velocity: Vector3<f64>,
    /// Inverse of the covariance of the biases before the outage.
    of_biases: SMatrix<f64, 6, 6>,
    /// `Σ w Gᵀ G`.
    information: SMatrix<f64, NAVIGATION, NAVIGATION>,
    /// `Σ w Gᵀ m`.
    of_motion: SVector<f64, NAVIGATION>,
    /// `Σ w Gᵀ eₖ yₗ` in the column `k + 3 l`.
    of_measured: SMatrix<f64, NAVIGATION, 9>,
    /// `Σ w m yᵀ`.
    products: Matrix3<f64>,
    /// `Σ w (|m|² + |y|²)`.
    squares: f64,
    components: u32,
}

impl Realignment {
    /// Begins at the end of an outage, with the biases of this estimate and their covariance, rows and columns of `covariance`. `None` if
    /// they are not regular.
    pub(in crate::navigation) fn new<const N: usize>(
        estimate: &Estimate<N>,
        covariance: &SMatrix<f64, N, N>,
        params: &EskfParams,
    ) -> Option<Self> {
        let biases =
            SMatrix::<f64, 6, 6>::from_fn(|i, j| covariance[(ACCELEROMETER_BIAS + i, ACCELEROMETER_BIAS + j)]);
        Some(Self {
            now_ns: estimate.time_ns,
            origin: estimate.position,
            gravity: params.gravity,
            densities: params.densities(),
            motion: Preintegration::new(estimate.accelerometer_bias, estimate.gyroscope_bias),
            angular_velocity: Vector3::zeros(),
            of_biases: Cholesky::new(biases)?.inverse(),
            information: SMatrix::zeros(),
            of_motion: SVector::zeros(),
            of_measured: SMatrix::zeros(),
            products: Matrix3::zeros(),
            squares: 0.0,
            components: 0,
        })
    }

    /// Adds a sample of the IMU.
    pub(in crate::navigation) fn propagate(&mut self, sample: &ImuMean) {
        let Ok(dt) = seconds_between(self.now_ns, sample.time_ns) else { return };
        self.now_ns = sample.time_ns;
        self.angular_velocity = sample.angular_velocity - self.motion.gyroscope_bias();
        self.motion.add(&sample.angular_velocity, &sample.specific_force, dt, &self.densities);
    }

    /// Adds a position at the present time.
    pub(in crate::navigation) fn position(&mut self, fix: &GnssPosition) {
        let t = self.motion.seconds();
        let fallen = Vector3::new(0.0, 0.0, -0.5 * self.gravity * t * t);
        let arm = self.motion.rotation() * fix.lever_arm;
        let by = [&self.motion.by_accelerometer, &self.motion.by_gyroscope];
        // The gyroscope's bias also turns the lever arm.
        let by_bias = [by[0].position, by[1].position - skew(&arm) * by[1].rotation];
        let variance = largest(&fix.covariance) + largest(&self.noise(POSITION));
        let measured = fix.position - self.origin - fallen;
        self.add([1.0, t], &measured, &(self.motion.position() + arm), &by_bias, variance);
    }

    /// Adds a velocity at the present time.
    pub(in crate::navigation) fn velocity(&mut self, fix: &GnssVelocity) {
        let t = self.motion.seconds();
        let fallen = Vector3::new(0.0, 0.0, -self.gravity * t);
        let swing = self.motion.rotation() * self.angular_velocity.cross(&fix.lever_arm);
        let by = [&self.motion.by_accelerometer, &self.motion.by_gyroscope];
        let by_bias = [by[0].velocity, by[1].velocity - skew(&swing) * by[1].rotation];
        let variance = largest(&fix.covariance) + largest(&self.noise(VELOCITY));
        self.add([0.0, 1.0], &(fix.velocity - fallen), &(self.motion.velocity() + swing), &by_bias, variance);
    }

    /// Covariance of the motion from the noise of the IMU.
    fn noise(&self, first: usize) -> Matrix3<f64> {
        let covariance = self.motion.covariance();
        Matrix3::from_fn(|i, j| covariance[first + i][first + j])
    }

    fn add(
        &mut self,
        factors: [f64; 2],
        measured: &Vector3<f64>,
        motion: &Vector3<f64>,
        by_bias: &[Matrix3<f64>; 2],
        variance: f64,
    ) {
        let weight = 1.0 / variance;
        if !(weight > 0.0 && weight.is_finite()) {
            return;
        }
        let mut rows = SMatrix::<f64, 3, NAVIGATION>::zeros();
        rows.fixed_view_mut::<3, 3>(0, TURN).copy_from(&-skew(motion));
        rows.fixed_view_mut::<3, 3>(0, PLACE).fill_diagonal(factors[0]);
        rows.fixed_view_mut::<3, 3>(0, SPEED).fill_diagonal(factors[1]);
        rows.fixed_view_mut::<3, 3>(0, BIASES).copy_from(&by_bias[0]);
        rows.fixed_view_mut::<3, 3>(0, BIASES + 3).copy_from(&by_bias[1]);
        let weighted = rows.transpose() * weight;
        self.information += weighted * rows;
        self.of_motion += weighted * motion;
        for l in 0..3 {
            let mut columns = self.of_measured.fixed_columns_mut::<3>(3 * l);
            columns += weighted * measured[l];
        }
        self.products += motion * measured.transpose() * weight;
        self.squares += weight * (motion.norm_squared() + measured.norm_squared());
        self.components += 3;
    }

    /// Wahba's solution, for the biases of before.
    fn first(&self) -> Option<Matrix3<f64>> {
        let factors = |one: usize, other: usize| self.information[(one, other)];
        let (pp, pv, vv) = (factors(PLACE, PLACE), factors(PLACE, SPEED), factors(SPEED, SPEED));
        let determinant = pp * vv - pv * pv;
        // Two positions at one time determine no velocity.
        if determinant.is_nan() || determinant <= 1e-12 * pp * vv {
            return None;
        }
        let motion = |first: usize| self.of_motion.fixed_rows::<3>(first).into_owned();
        let measured = |first: usize| Vector3::from_fn(|l, _| self.of_measured[(first, 3 * l)]);
        let (mp, mv, yp, yv) = (motion(PLACE), motion(SPEED), measured(PLACE), measured(SPEED));
        // Σ w m yᵀ less what position and velocity explain.
        let place = (mp * vv - mv * pv) / determinant;
        let speed = (mv * pp - mp * pv) / determinant;
        let rest = self.products - place * yp.transpose() - speed * yv.transpose();
        let decomposed = SVD::try_new(rest.transpose(), true, true, f64::EPSILON, 100)?;
        let (left, right) = (decomposed.u?, decomposed.v_t?);
        let mut signs = Vector3::from_element(1.0);
        let least = decomposed.singular_values.imin();
        signs[least] = if (left * right).determinant() < 0.0 { -1.0 } else { 1.0 };
        Some(left * Matrix3::from_diagonal(&signs) * right)
    }

    /// The state now, once its attitude is known; `None` before.
    ///
    /// # Errors
    ///
    /// [`Dropped`] if the measurements so far are of no use.
    pub(in crate::navigation) fn solve(&self) -> Result<Option<Realigned>, Dropped> {
        let is_too_long = self.motion.seconds() > LONGEST_S;
        let unsolved = || if is_too_long { Err(Dropped::TooLong) } else { Ok(None) };
        let mut information = self.information;
        let mut biases = information.fixed_view_mut::<6, 6>(BIASES, BIASES);
        biases += self.of_biases;
        let (Some(first), Some(information)) = (self.first(), Cholesky::new(information)) else {
            return unsolved();
        };
        let mut world_from_first = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(first));
        let mut steps = 0;
        let (solution, misfit) = loop {
            let matrix = world_from_first.to_rotation_matrix().into_inner();
            // Σ w Gᵀ (R₀ᵀ y - m): the component k of R₀ᵀ y is Σ R₀(l, k) yₗ.
            let turned = SVector::<f64, 9>::from_fn(|i, _| matrix[(i / 3, i % 3)]);
            let right = self.of_measured * turned - self.of_motion;
            let solution = information.solve(&right);
            let turn = solution.fixed_rows::<3>(TURN).into_owned();
            let least = self.squares - 2.0 * (self.products * matrix).trace() - right.dot(&solution);
            if turn.norm_squared() < CONVERGED * CONVERGED {
                break (solution, least);
            }
            if steps == STEPS {
                return unsolved();
            }
            steps += 1;
            world_from_first = renormalised(&(world_from_first * rotation(&turn)));
        };
        if self.components > 9 && misfit > limit(f64::from(self.components - 9)) {
            return Err(Dropped::Misfit);
        }
        let realigned = self.now(&world_from_first, &solution, &information.inverse());
        let turn = realigned.covariance.fixed_view::<3, 3>(ROTATION, ROTATION).trace();
        let is_known = self.components > 9 && turn < KNOWN * KNOWN;
        if is_known { Ok(Some(realigned)) } else { unsolved() }
    }

    /// Takes a solution at the end of the outage to the present time.
    fn now(
        &self,
        world_from_first: &UnitQuaternion<f64>,
        solution: &SVector<f64, NAVIGATION>,
        covariance: &SMatrix<f64, NAVIGATION, NAVIGATION>,
    ) -> Realigned {
        let t = self.motion.seconds();
        let part = |first: usize| solution.fixed_rows::<3>(first).into_owned();
        let (place, speed) = (part(PLACE), part(SPEED));
        let (accelerometer, gyroscope) = (part(BIASES), part(BIASES + 3));
        let (by_accelerometer, by_gyroscope) = (&self.motion.by_accelerometer, &self.motion.by_gyroscope);
        let position =
            self.motion.position() + by_accelerometer.position * accelerometer + by_gyroscope.position * gyroscope;
        let velocity =
            self.motion.velocity() + by_accelerometer.velocity * accelerometer + by_gyroscope.velocity * gyroscope;
        let turn = rotation(&(by_gyroscope.rotation * gyroscope)) * self.motion.rotation();

        // The errors now, still in the axes of the body at the end of the outage, of those at the end.
        let mut transition = SMatrix::<f64, NAVIGATION, NAVIGATION>::zeros();
        let one = Matrix3::identity();
        let mut set = |row: usize, column: usize, block: &Matrix3<f64>| {
            transition.fixed_view_mut::<3, 3>(row, column).copy_from(block);
        };
        set(POSITION, TURN, &-skew(&position));
        set(POSITION, PLACE, &one);
        set(POSITION, SPEED, &(one * t));
        set(POSITION, BIASES, &by_accelerometer.position);
        set(POSITION, BIASES + 3, &by_gyroscope.position);
        set(VELOCITY, TURN, &-skew(&velocity));
        set(VELOCITY, SPEED, &one);
        set(VELOCITY, BIASES, &by_accelerometer.velocity);
        set(VELOCITY, BIASES + 3, &by_gyroscope.velocity);
        set(ROTATION, TURN, &one);
        set(ROTATION, BIASES + 3, &by_gyroscope.rotation);
        set(ACCELEROMETER_BIAS, BIASES, &one);
        set(GYROSCOPE_BIAS, BIASES + 3, &one);
        let noise = self.motion.covariance();
        let noise = SMatrix::<f64, NAVIGATION, NAVIGATION>::from_fn(|i, j| noise[i][j]);
        let covariance = transition * covariance * transition.transpose() + noise;
        let matrix = world_from_first.to_rotation_matrix().into_inner();
        let mut axes = SMatrix::<f64, NAVIGATION, NAVIGATION>::identity();
        for first in [POSITION, VELOCITY, ROTATION] {
            axes.fixed_view_mut::<3, 3>(first, first).copy_from(&matrix);
        }
        let covariance = axes * covariance * axes.transpose();
        let fall = Vector3::new(0.0, 0.0, -self.gravity * t);
        Realigned {
            position: self.origin + world_from_first * (place + speed * t + position) + fall * (0.5 * t),
            velocity: world_from_first * (speed + velocity) + fall,
            world_from_body: renormalised(&(world_from_first * turn)),
            accelerometer_bias: self.motion.accelerometer_bias() + accelerometer,
            gyroscope_bias: self.motion.gyroscope_bias() + gyroscope,
            covariance: 0.5 * (covariance + covariance.transpose()),
        }
    }
}

/// An upper bound on the variance in any direction; exact for a diagonal covariance.
fn largest(covariance: &Matrix3<f64>) -> f64 {
    covariance.row_iter().map(|row| row.iter().map(|x| x.abs()).sum::<f64>()).fold(0.0, f64::max)
}

/// The χ² at the quantile [`MOST_MISFIT`]; E. B. Wilson, M. M. Hilferty, "The distribution of chi-square", PNAS 17(12), 1931. The exact
/// recurrence of `chi_square.rs` underflows at the thousands of degrees of freedom that fast receivers reach.
fn limit(freedom: f64) -> f64 {
    let variance = 2.0 / (9.0 * freedom);
    let root = 1.0 - variance + MOST_MISFIT * sqrt(variance);
    freedom * root * root * root
}
