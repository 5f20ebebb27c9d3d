//! Preintegration: combines the IMU samples between two keyframes.
//!
//! C. Forster, L. Carlone, F. Dellaert, D. Scaramuzza, "On-manifold preintegration for real-time visual–inertial odometry",
//! IEEE Transactions on Robotics 33(1), 2017. Two things are added: the mean is exact over a sample, as in
//! `eskf/propagation.rs`; and the covariance includes the random walk of the biases, which correlates them with the rest.
//!
//! All quantities are in the body's axes at the first keyframe, without gravity. `ΔR`, `Δv` and `Δp` start from
//! identity, zero and zero. For one sample of length dt, let B = -ΔR Γ1 dt and B₂ = -ΔR Γ2 dt², and let T, T₂ be the
//! derivatives of the two increments δv, δp with respect to the gyroscope's bias. Then
//!
//! * `θ⁺ = θ + B b_g`
//! * `v⁺ = v - [δv]× θ + B b_a + T b_g`
//! * `p⁺ = p + v dt - [δp]× θ + B₂ b_a + T₂ b_g`
//!
//! for errors θ, v, p. The derivatives with respect to the biases follow the same recursion.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use crate::navigation::eskf::ImuDensities;
use crate::navigation::math::{Integrals, renormalised, rotation, skew};
use crate::navigation::state::{ACCELEROMETER_BIAS, GYROSCOPE_BIAS, NAVIGATION, POSITION, ROTATION, VELOCITY};

/// A 3 × 3 matrix for each of position, velocity and rotation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::navigation) struct Columns {
    pub(in crate::navigation) position: Matrix3<f64>,
    pub(in crate::navigation) velocity: Matrix3<f64>,
    pub(in crate::navigation) rotation: Matrix3<f64>,
}

/// The motion over IMU samples, its derivatives with respect to the biases, and its covariance.
///
/// ```
/// use bb_estimators::navigation::{ImuDensities, Preintegration};
/// use nalgebra::Vector3;
///
/// let densities = ImuDensities { accelerometer: 4e-6, gyroscope: 3e-8, accelerometer_bias: 9e-6, gyroscope_bias: 4e-10 };
/// let (turn, ahead) = (Vector3::new(0.0, 0.0, 0.5), Vector3::new(1.0, 0.0, 0.0));
/// let mut motion = Preintegration::new(Vector3::zeros(), Vector3::zeros());
/// for _ in 0..100 {
///     motion.add(&turn, &ahead, 0.01, &densities);
/// }
/// assert!((motion.rotation().angle() - 0.5).abs() < 1e-12);
/// // Ahead, and to the left as it turns.
/// assert!(motion.velocity().x > 0.9 && motion.velocity().y > 0.2);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Preintegration {
    accelerometer_bias: Vector3<f64>,
    gyroscope_bias: Vector3<f64>,
    seconds: f64,
    position: Vector3<f64>,
    velocity: Vector3<f64>,
    rotation: UnitQuaternion<f64>,
    /// Derivatives with respect to the accelerometer's bias; zero for the rotation.
    pub(in crate::navigation) by_accelerometer: Columns,
    /// Derivatives with respect to the gyroscope's bias.
    pub(in crate::navigation) by_gyroscope: Columns,
    /// Covariance of y with the accelerometer's bias; see [`add_covariance`](Self::add_covariance).
    with_accelerometer: Columns,
    /// Covariance of y with the gyroscope's bias.
    with_gyroscope: Columns,
    /// Variance of each component of a bias, from its random walk.
    accelerometer_walk: f64,
    gyroscope_walk: f64,
    /// Covariance of y, blocks of position, velocity and rotation on and above the diagonal.
    pp: Matrix3<f64>,
    pv: Matrix3<f64>,
    pr: Matrix3<f64>,
    vv: Matrix3<f64>,
    vr: Matrix3<f64>,
    rr: Matrix3<f64>,
}

impl Columns {
    const fn zeros() -> Self {
        const ZERO: Matrix3<f64> = Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        Self { position: ZERO, velocity: ZERO, rotation: ZERO }
    }

    /// `Φ X`: the transition over one sample.
    #[inline]
    fn carried(&self, dt: f64, change: &Increments) -> Self {
        Self {
            position: self.position + self.velocity * dt - crossed(&change.position, &self.rotation),
            velocity: self.velocity - crossed(&change.velocity, &self.rotation),
            rotation: self.rotation,
        }
    }

    /// Carries columns whose rotation part is zero over a time.
    #[inline]
    fn carried_straight(&self, dt: f64) -> Self {
        Self { position: self.position + self.velocity * dt, ..*self }
    }

    #[inline]
    fn plus(&self, other: &Self, factor: f64) -> Self {
        Self {
            position: self.position + other.position * factor,
            velocity: self.velocity + other.velocity * factor,
            rotation: self.rotation + other.rotation * factor,
        }
    }
}

/// Selects one of the three matrices.
type Part = fn(&Columns) -> &Matrix3<f64>;

/// The increments of velocity and position over one sample.
#[derive(Clone, Copy, Debug)]
struct Increments {
    position: Vector3<f64>,
    velocity: Vector3<f64>,
}

impl Preintegration {
    /// An empty motion, integrated at these biases.
    pub fn new(accelerometer_bias: Vector3<f64>, gyroscope_bias: Vector3<f64>) -> Self {
        Self {
            accelerometer_bias,
            gyroscope_bias,
            seconds: 0.0,
            position: Vector3::zeros(),
            velocity: Vector3::zeros(),
            rotation: UnitQuaternion::identity(),
            by_accelerometer: Columns::zeros(),
            by_gyroscope: Columns::zeros(),
            with_accelerometer: Columns::zeros(),
            with_gyroscope: Columns::zeros(),
            accelerometer_walk: 0.0,
            gyroscope_walk: 0.0,
            pp: Matrix3::zeros(),
            pv: Matrix3::zeros(),
            pr: Matrix3::zeros(),
            vv: Matrix3::zeros(),
            vr: Matrix3::zeros(),
            rr: Matrix3::zeros(),
        }
    }

    /// Adds a sample: the measured means over `dt` seconds, in body axes, rad/s and m/s².
    pub fn add(
        &mut self,
        angular_velocity: &Vector3<f64>,
        specific_force: &Vector3<f64>,
        dt: f64,
        densities: &ImuDensities,
    ) {
        let force = specific_force - self.accelerometer_bias;
        let turn = (angular_velocity - self.gyroscope_bias) * dt;
        let integrals = Integrals::new(&turn);
        let to_first = self.rotation.to_rotation_matrix().into_inner();
        let first = to_first * integrals.first_matrix(&turn) * dt;
        let second = to_first * integrals.second_matrix(&turn) * (dt * dt);
        let change = Increments { position: second * force, velocity: first * force };

        // ∂(Γ f)/∂φ to second order in φ, from c₁ φ × f + c₂ φ × (φ × f) and [φ]×[f]× = f φᵀ - (φ·f) I.
        let linear = skew(&force);
        let mut square = skew(&turn.cross(&force)) + force * turn.transpose();
        square -= Matrix3::from_diagonal_element(turn.dot(&force));
        let by_turn = |c1: f64, c2: f64| to_first * (linear * c1 + square * c2);
        let by_accelerometer = Columns { position: -second, velocity: -first, rotation: Matrix3::zeros() };
        let by_gyroscope = Columns {
            position: by_turn(dt * dt * dt / 6.0, dt * dt * dt / 24.0),
            velocity: by_turn(dt * dt / 2.0, dt * dt / 6.0),
            rotation: -first,
        };

        self.by_accelerometer = self.by_accelerometer.carried_straight(dt).plus(&by_accelerometer, 1.0);
        self.by_gyroscope = self.by_gyroscope.carried(dt, &change).plus(&by_gyroscope, 1.0);
        self.add_covariance(dt, &change, densities);
        self.position += self.velocity * dt + change.position;
        self.velocity += change.velocity;
        self.rotation = renormalised(&(self.rotation * rotation(&turn)));
        self.seconds += dt;
    }

    /// Propagates the covariance of `y = x - J b`: the errors less the contribution of the biases. The biases do not
    /// enter its transition.
    #[inline]
    fn add_covariance(&mut self, dt: f64, change: &Increments, densities: &ImuDensities) {
        // Φ P, then (Φ P) Φᵀ; the rotation error has no transition.
        let rotation_velocity = self.vr.transpose();
        let vr = self.vr - crossed(&change.velocity, &self.rr);
        let vv = self.vv - crossed(&change.velocity, &rotation_velocity);
        let pr = self.pr + self.vr * dt - crossed(&change.position, &self.rr);
        let pv = self.pv + self.vv * dt - crossed(&change.position, &rotation_velocity);
        let pp = self.pp + self.pv.transpose() * dt - crossed(&change.position, &self.pr.transpose());
        self.pp = pp + pv * dt - crossed_right(&pr, &change.position);
        self.pv = pv - crossed_right(&pr, &change.velocity);
        self.pr = pr;
        self.vv = vv - crossed_right(&vr, &change.velocity);
        self.vr = vr;

        // A step n of a bias adds -J n to them, where J is the derivative with respect to the bias so far.
        let accelerometer = densities.accelerometer_bias * dt;
        let by = &self.by_accelerometer;
        let (position, velocity) =
            (by.position.transpose() * accelerometer, by.velocity.transpose() * accelerometer);
        self.pp += by.position * position;
        self.pv += by.position * velocity;
        self.vv += by.velocity * velocity;
        self.with_accelerometer = self.with_accelerometer.carried_straight(dt).plus(by, -accelerometer);

        let gyroscope = densities.gyroscope_bias * dt;
        let by = &self.by_gyroscope;
        let (position, velocity) = (by.position.transpose() * gyroscope, by.velocity.transpose() * gyroscope);
        let rotation = by.rotation.transpose() * gyroscope;
        self.pp += by.position * position;
        self.pv += by.position * velocity;
        self.pr += by.position * rotation;
        self.vv += by.velocity * velocity;
        self.vr += by.velocity * rotation;
        self.rr += by.rotation * rotation;
        self.with_gyroscope = self.with_gyroscope.carried(dt, change).plus(by, -gyroscope);

        // White noise of density q on a derivative gives q [dt³/3, dt²/2; dt²/2, dt] on position and velocity.
        let velocity = densities.accelerometer * dt;
        for i in 0..3 {
            self.pp[(i, i)] += velocity * dt * dt / 3.0;
            self.pv[(i, i)] += velocity * dt * 0.5;
            self.vv[(i, i)] += velocity;
            self.rr[(i, i)] += densities.gyroscope * dt;
        }
        self.accelerometer_walk += accelerometer;
        self.gyroscope_walk += gyroscope;
    }

    /// Total duration of the samples, s.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// The accelerometer's bias that was subtracted from the samples, m/s².
    pub fn accelerometer_bias(&self) -> &Vector3<f64> {
        &self.accelerometer_bias
    }

    /// The gyroscope's bias that was subtracted from the samples, rad/s.
    pub fn gyroscope_bias(&self) -> &Vector3<f64> {
        &self.gyroscope_bias
    }

    /// Position in the body's axes at the first keyframe, m, without gravity and the initial velocity.
    pub fn position(&self) -> &Vector3<f64> {
        &self.position
    }

    /// Velocity gained from the specific force, in the axes of the first keyframe, m/s.
    pub fn velocity(&self) -> &Vector3<f64> {
        &self.velocity
    }

    /// Rotates body coordinates at the end to those of the first keyframe.
    pub fn rotation(&self) -> &UnitQuaternion<f64> {
        &self.rotation
    }

    /// Covariance of the errors at the end, given those at the first keyframe, 15 × 15. The order is that of
    /// [`POSITION`] to [`GYROSCOPE_BIAS`], and all errors are in the axes of the first keyframe.
    pub fn covariance(&self) -> [[f64; NAVIGATION]; NAVIGATION] {
        let mut covariance = [[0.0; NAVIGATION]; NAVIGATION];
        self.write_covariance(&mut covariance);
        covariance
    }

    /// Writes the same covariance to the first rows and columns of a matrix that is zero there.
    #[inline]
    pub(super) fn write_covariance<const N: usize>(&self, covariance: &mut [[f64; N]; N]) {
        let mut set = |row: usize, column: usize, block: &Matrix3<f64>| {
            for i in 0..3 {
                for j in 0..3 {
                    covariance[row + i][column + j] = block[(i, j)];
                    covariance[column + j][row + i] = block[(i, j)];
                }
            }
        };
        // x = y + J b: `P + J M ᵀ + (J Mᵀ)ᵀ + b J Jᵀ` with the covariance M of y and b.
        let (accelerometer, gyroscope) = (&self.by_accelerometer, &self.by_gyroscope);
        let half_accelerometer = self.with_accelerometer.plus(accelerometer, 0.5 * self.accelerometer_walk);
        let half_gyroscope = self.with_gyroscope.plus(gyroscope, 0.5 * self.gyroscope_walk);
        let whole = |block: &Matrix3<f64>, row: Part, column: Part| {
            let of = |by: &Columns, half: &Columns| {
                row(by) * column(half).transpose() + row(half) * column(by).transpose()
            };
            block + of(accelerometer, &half_accelerometer) + of(gyroscope, &half_gyroscope)
        };
        let position: Part = |columns| &columns.position;
        let velocity: Part = |columns| &columns.velocity;
        let rotation: Part = |columns| &columns.rotation;
        set(POSITION, POSITION, &whole(&self.pp, position, position));
        set(POSITION, VELOCITY, &whole(&self.pv, position, velocity));
        set(POSITION, ROTATION, &whole(&self.pr, position, rotation));
        set(VELOCITY, VELOCITY, &whole(&self.vv, velocity, velocity));
        set(VELOCITY, ROTATION, &whole(&self.vr, velocity, rotation));
        set(ROTATION, ROTATION, &whole(&self.rr, rotation, rotation));
        for (bias, columns) in [
            (ACCELEROMETER_BIAS, self.with_accelerometer.plus(accelerometer, self.accelerometer_walk)),
            (GYROSCOPE_BIAS, self.with_gyroscope.plus(gyroscope, self.gyroscope_walk)),
        ] {
            set(POSITION, bias, &columns.position);
            set(VELOCITY, bias, &columns.velocity);
            set(ROTATION, bias, &columns.rotation);
        }
        set(ACCELEROMETER_BIAS, ACCELEROMETER_BIAS, &Matrix3::from_diagonal_element(self.accelerometer_walk));
        set(GYROSCOPE_BIAS, GYROSCOPE_BIAS, &Matrix3::from_diagonal_element(self.gyroscope_walk));
    }
}

/// `[v]× M`.
#[inline]
fn crossed(v: &Vector3<f64>, matrix: &Matrix3<f64>) -> Matrix3<f64> {
    let m = |i: usize, j: usize| matrix[(i, j)];
    Matrix3::from_fn(|i, j| match i {
        0 => v.y * m(2, j) - v.z * m(1, j),
        1 => v.z * m(0, j) - v.x * m(2, j),
        _ => v.x * m(1, j) - v.y * m(0, j),
    })
}

/// `M [v]×ᵀ`.
#[inline]
fn crossed_right(matrix: &Matrix3<f64>, v: &Vector3<f64>) -> Matrix3<f64> {
    let m = |i: usize, j: usize| matrix[(i, j)];
    Matrix3::from_fn(|i, j| match j {
        0 => v.y * m(i, 2) - v.z * m(i, 1),
        1 => v.z * m(i, 0) - v.x * m(i, 2),
        _ => v.x * m(i, 1) - v.y * m(i, 0),
    })
}
