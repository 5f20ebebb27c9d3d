//! Offset of the magnetometer, by iron on the body, with its lag behind the gyroscope: the ones that are subtracted, and others that
//! may replace them.

use nalgebra::{Matrix3, Matrix3x4, Matrix4, Matrix4x3, Vector3, Vector4};

use super::numbers::{
    ANY_OFFSET, CALIBRATED, FIELD_WALK, FIRST_POSES, LATER_ODDS, LEAST_WALK, MAGNETOMETER_LAG, NEWCOMER_POSES,
    ODDS, PLACES, POSE_TURN, SCALE_TURN, SHARPER, SHORT_S, TAILS,
};
use super::params::Magnetometer;
use crate::attitude::Real;

/// One hypothesis: the world's field walks from pose to pose, with the steps of Student's distribution, and the body
/// adds an offset. In units of the field. The magnetometer lags behind the gyroscope: a field that turns is off by its rate of change.
///
/// Its state is the field that the present pose is to measure, in the world frame, rather than the world's field: the poses
/// measure it directly, with errors that are the same along all axes, so that the equations of the update are short.
#[derive(Clone, Debug, PartialEq)]
struct Hypothesis<T: Real> {
    expected: Vector3<T>,
    /// The offset, and the lag in s.
    sensor: Vector4<T>,
    /// Covariances of the expected field, of offset and lag with it, and of these.
    of_expected: Matrix3<T>,
    of_both: Matrix4x3<T>,
    of_sensor: Matrix4<T>,
    /// Scale of a step, squared, as learnt.
    step: T,
    poses: T,
    /// Variances of offset and lag before the first pose, and sum of the squares of the angles between poses since.
    prior: Vector4<T>,
    turned: T,
}

/// Determinant of the covariance of a measured field and squared distance from the expected one, over its scale.
struct Surprise<T> {
    determinant: T,
    squared: T,
}

impl<T: Real> Hypothesis<T> {
    fn new(deviation: f64) -> Self {
        let of_offset = T::of(deviation * deviation);
        let prior = Vector4::new(of_offset, of_offset, of_offset, T::of(MAGNETOMETER_LAG * MAGNETOMETER_LAG));
        Self {
            expected: Vector3::zeros(),
            sensor: Vector4::zeros(),
            of_expected: Matrix3::zeros(),
            of_both: Matrix4x3::zeros(),
            of_sensor: Matrix4::from_diagonal(&prior),
            step: T::of(FIELD_WALK * FIELD_WALK),
            poses: T::ZERO,
            prior,
            turned: T::ZERO,
        }
    }

    fn offset(&self) -> Vector3<T> {
        self.sensor.xyz()
    }

    /// Begins with a pose: nothing is known of the world's field but what this field tells.
    fn begin(&mut self, pose: &Pose<T>) {
        self.expected = pose.rotation * pose.field;
        self.of_expected = Matrix3::from_diagonal_element(self.step);
        self.of_both = Matrix4x3::zeros();
    }

    /// Derivatives of the field that a pose measures by offset and lag, in the world frame.
    fn seen(&self, pose: &Pose<T>) -> Matrix3x4<T> {
        let changing = pose.rotation * pose.rate.cross(&(pose.field - self.offset()));
        let [x, y, z] = [0, 1, 2].map(|axis| pose.rotation.column(axis).into_owned());
        Matrix3x4::from_columns(&[x, y, z, changing])
    }

    /// Adds the pose after the last one. `None` if the covariance is singular.
    fn observe(&mut self, last: &Pose<T>, pose: &Pose<T>) -> Option<Surprise<T>> {
        let measured = pose.rotation * pose.field;
        let turned = self.seen(pose) - self.seen(last);
        self.expected += turned * self.sensor;
        let moved = self.of_sensor * turned.transpose();
        let half = turned * (self.of_both + moved * T::HALF);
        let mut of_expected = self.of_expected + half + half.transpose();
        self.of_both += moved;
        let residual = measured - self.expected;
        // A step and an error of the magnetometer have one scale.
        let white = self.step;
        of_expected += Matrix3::from_diagonal_element(white);
        let (mut inverse, determinant) = inverse_of_symmetric(&of_expected, white)?;
        let squared = residual.dot(&(inverse * residual));
        let (tails, freedom) = (T::of(TAILS), T::of(TAILS + 3.0));
        let weight = freedom / (tails + squared);
        self.poses += T::ONE;
        self.turned += last.squared_angle(&pose.rotation);
        let learnt = weight * squared / T::of(3.0) - T::ONE;
        self.step *= T::ONE + learnt / (self.poses + T::of(FIRST_POSES));
        self.step = self.step.max(T::of(LEAST_WALK * LEAST_WALK));
        // A step that is too large for the scale is one, rather than an error of the sensor.
        if weight < T::ONE {
            of_expected += Matrix3::from_diagonal_element(white / weight - white);
            (inverse, _) = inverse_of_symmetric(&of_expected, white)?;
        }
        let gain = self.of_both * inverse;
        self.expected = measured - inverse * residual * white;
        self.sensor += gain * residual;
        self.of_sensor -= gain * self.of_both.transpose();
        self.of_both = gain * white;
        self.of_expected = (Matrix3::identity() - inverse * white) * white;
        Some(Surprise { determinant, squared })
    }

    /// Variance of the offset along a direction of the body, with the square of the largest error by what goes with the turns.
    ///
    /// From poses `i` with `x_i = x_(i-1) + T_i offset`, an offset of covariance `P` is off by `P Σ T_iᵀ e_i / step` for errors `e_i`. If
    /// none of them is longer than `part` times the angle of its turn, the square of that along `a` is at most
    /// `part² Σ angle² · aᵀ P (Σ T_iᵀ T_i / step²) P a`, by Cauchy and Schwarz, where `P⁻¹ = 1 / prior + Σ T_iᵀ T_i / step`.
    fn along(&self, along: &Vector3<T>, part: T) -> T {
        let along = along.push(T::ZERO);
        let moved = self.of_sensor * along;
        let variance = along.dot(&moved);
        if self.prior.x <= T::ZERO {
            return variance;
        }
        let told = (variance - moved.component_mul(&moved).component_div(&self.prior).sum()).max(T::ZERO);
        variance + part * part * told * self.turned / self.step
    }

    /// Variance of the offset along an axis, as the poses tell it.
    fn variance(&self) -> T {
        self.of_sensor.fixed_view::<3, 3>(0, 0).trace() / T::of(3.0)
    }

    /// The offset, as far as it is larger than its deviation.
    ///
    /// An estimate of variance `σ²` along each axis, of an offset of unknown variance `τ²`, has the mean square `3 (τ² + σ²)`;
    /// the part `τ² / (τ² + σ²)` of it is the offset. B. Efron, C. Morris, "Stein's estimation rule and its competitors: an
    /// empirical Bayes approach", Journal of the American Statistical Association 68, 1973.
    fn believed(&self) -> Vector3<T> {
        // With what the field's changes from place to place look like.
        let unknown = T::of(3.0) * (self.variance() + T::of(PLACES * PLACES));
        let squared = self.offset().norm_squared();
        if squared > unknown { self.offset() * (T::ONE - unknown / squared) } else { Vector3::zeros() }
    }
}

/// A pose with the angular velocity and the field measured in it, body frame; the field in units of its norm, once that is known.
#[derive(Clone, Debug, PartialEq)]
struct Pose<T: Real> {
    rotation: Matrix3<T>,
    rate: Vector3<T>,
    field: Vector3<T>,
    age_s: T,
}

impl<T: Real> Pose<T> {
    /// Twice the versine of the angle to another pose, for a small angle its square.
    fn squared_angle(&self, rotation: &Matrix3<T>) -> T {
        T::HALF * (rotation - self.rotation).norm_squared()
    }
}

/// The incumbent, whose offset is subtracted, and a newcomer with any offset, which replaces it once it explains the fields
/// so much better that it outweighs the odds against it.
///
/// So iron that is put on, taken off or moved is one case. A newcomer that has not won for long starts again, since what it
/// has seen before a change speaks against it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct HardIron<T: Real> {
    incumbent: Hypothesis<T>,
    newcomer: Hypothesis<T>,
    /// The incumbent's offset as far as it is believed, in the unit of the field.
    offset: Vector3<T>,
    /// Logarithm of the odds of the newcomer.
    odds: T,
    /// `true` if the user has stated that the magnetometer is calibrated, so that there is no newcomer.
    is_calibrated: bool,
    /// `true` once a newcomer has won or lost, or the user has stated whether there is an offset.
    is_settled: bool,
    /// Deviation of the offset when the heading was last doubted for it, zero while it is what calibration leaves.
    doubted: T,
    /// The last pose, and sums of how much the field changed and the body turned from pose to pose, squared.
    pose: Option<Pose<T>>,
    changed: T,
    turned: T,
    /// The norm of the field, once the body has turned enough to know it: an offset does not turn with the world.
    scale: Option<T>,
}

impl<T: Real> HardIron<T> {
    pub(super) fn new(magnetometer: Magnetometer) -> Self {
        let (deviation, doubted) = match magnetometer {
            Magnetometer::Uncalibrated => (ANY_OFFSET, ANY_OFFSET),
            Magnetometer::Auto => (CALIBRATED, 0.0),
            Magnetometer::Calibrated | Magnetometer::None => (0.0, 0.0),
        };
        Self {
            incumbent: Hypothesis::new(deviation),
            newcomer: Hypothesis::new(ANY_OFFSET),
            offset: Vector3::zeros(),
            odds: -T::of(ODDS),
            is_calibrated: magnetometer == Magnetometer::Calibrated,
            is_settled: magnetometer != Magnetometer::Auto,
            doubted: T::of(doubted),
            pose: None,
            changed: T::ZERO,
            turned: T::ZERO,
            scale: None,
        }
    }

    /// The offset to subtract from a measured field, body frame.
    pub(super) fn offset(&self) -> Vector3<T> {
        self.offset
    }

    /// The present field, body frame, of a measured one at an angular velocity.
    pub(super) fn field(&self, rate: &Vector3<T>, measured: &Vector3<T>) -> Vector3<T> {
        let field = measured - self.offset;
        field - rate.cross(&field) * self.incumbent.sensor.w
    }

    /// Variance of the offset along an axis.
    pub(super) fn variance(&self) -> T {
        self.incumbent.variance() * self.scale() * self.scale()
    }

    /// Expected square of the error of the offset along a direction of the body, as a fraction of the field's norm.
    ///
    /// An offset of the newcomer's variance `σ²` and distance `d` from the incumbent's has the expected square `d² + σ²`, with
    /// the odds so far. They say little for long: fields that a small offset explains as well as none speak against one of
    /// any size, and so against the small one. Before the first newcomer has won or lost, the logarithm of the offset's size is
    /// uniform instead, down to what a calibration leaves, `c`: the part `1 / (1 + ln (σ / c))` of the expected square is left.
    ///
    /// `with_turns` is the largest part of the field that may go with the angle from pose to pose, 1/rad. It does not average out.
    pub(super) fn doubt(&self, along: &Vector3<T>, with_turns: T) -> T {
        let of = |hypothesis: &Hypothesis<T>| hypothesis.along(along, with_turns);
        let known = of(&self.incumbent);
        if self.is_calibrated {
            return known;
        }
        let variance = of(&self.newcomer);
        let moved = along.dot(&(self.newcomer.offset() - self.incumbent.believed()));
        let odds = (self.odds + T::of(ODDS)).min(T::ZERO).exp();
        let mut part = odds / (T::ONE + odds);
        if !self.is_settled {
            let ratio = (variance / T::of(CALIBRATED * CALIBRATED)).max(T::ONE);
            part = part.max(T::ONE / (T::ONE + T::HALF * ratio.ln()));
        }
        known + (moved * moved + variance) * part
    }

    /// The norm of the world's field, zero before it is known.
    pub(super) fn scale(&self) -> T {
        self.scale.unwrap_or(T::ZERO)
    }

    /// Drops the last pose, so that the next one is compared with none before it.
    pub(super) fn interrupt(&mut self) {
        self.pose = None;
    }

    /// Adds to the age of the last pose.
    pub(super) fn age(&mut self, dt: T) {
        if let Some(pose) = &mut self.pose {
            pose.age_s += dt;
        }
    }

    /// Returns whether the body has turned enough since the last pose for another, or that is too old.
    pub(super) fn is_due(&self, rotation: &Matrix3<T>) -> bool {
        self.pose.as_ref().is_none_or(|pose| {
            pose.age_s > T::of(SHORT_S) || pose.squared_angle(rotation) >= T::of(POSE_TURN * POSE_TURN)
        })
    }

    /// Adds a field in a pose that is due. Poses in one field show an offset by how it turns, whatever the heading.
    ///
    /// Returns by how much the heading so far was wrong for the offset, in the unit of the field, when another offset is
    /// found, or the same is known much better than when this was said before.
    pub(super) fn observe(&mut self, rotation: &Matrix3<T>, rate: &Vector3<T>, field: &Vector3<T>) -> Option<T> {
        let mut pose = Pose { rotation: *rotation, rate: *rate, field: *field, age_s: T::ZERO };
        let last = self.pose.take().filter(|last| last.age_s <= T::of(SHORT_S));
        let (Some(last), Some(scale)) = (&last, self.scale) else {
            if let Some(last) = last {
                // Of a field in any direction, two thirds turn.
                self.changed += (field - last.field).norm_squared();
                self.turned += last.squared_angle(rotation) * T::of(2.0 / 3.0);
                if self.turned > T::of(SCALE_TURN * SCALE_TURN) && self.changed > T::ZERO {
                    self.scale = Some((self.changed / self.turned).sqrt());
                }
            }
            pose.field /= self.scale.unwrap_or(T::ONE);
            self.incumbent.begin(&pose);
            self.newcomer.begin(&pose);
            self.pose = Some(pose);
            return None;
        };
        pose.field /= scale;
        let pose = self.pose.insert(pose);
        let of_incumbent = self.incumbent.observe(last, pose);
        self.offset = self.incumbent.believed() * scale;
        if !self.is_calibrated {
            if let (Some(one), Some(other)) = (self.newcomer.observe(last, pose), of_incumbent) {
                let tails = T::of(TAILS);
                let nearer = (tails + other.squared) / (tails + one.squared);
                self.odds += T::HALF * (other.determinant / one.determinant).ln()
                    + T::HALF * T::of(TAILS + 3.0) * nearer.ln();
            }
            let moved = (self.newcomer.offset() - self.incumbent.believed()).norm_squared();
            let variance = self.newcomer.variance();
            if self.odds > T::ZERO && variance < moved {
                self.incumbent = self.newcomer.clone();
                self.restart();
                self.offset = self.incumbent.believed() * scale;
                self.doubted = variance.sqrt();
                return Some((moved + variance).sqrt() * scale);
            }
            if self.newcomer.poses > T::of(NEWCOMER_POSES) && self.odds < -T::of(ODDS) {
                self.restart();
            }
        }
        let deviation = self.incumbent.variance().sqrt();
        if deviation < T::of(SHARPER) * self.doubted {
            return Some(scale * core::mem::replace(&mut self.doubted, deviation));
        }
        None
    }

    /// Starts another newcomer at the last pose.
    fn restart(&mut self) {
        self.odds = -T::of(LATER_ODDS);
        self.is_settled = true;
        self.newcomer = Hypothesis::new(ANY_OFFSET);
        self.newcomer.step = self.incumbent.step;
        if let Some(pose) = &self.pose {
            self.newcomer.begin(pose);
        }
    }
}

/// The inverse of a symmetric matrix with `white` added to its diagonal, and the determinant; `None` if it has none.
#[inline(always)]
fn inverse_of_symmetric<T: Real>(matrix: &Matrix3<T>, white: T) -> Option<(Matrix3<T>, T)> {
    let [xx, yy, zz] = [matrix.m11 + white, matrix.m22 + white, matrix.m33 + white];
    let [xy, xz, yz] = [matrix.m12, matrix.m13, matrix.m23];
    let [of_xx, of_xy, of_xz] = [yy * zz - yz * yz, yz * xz - xy * zz, xy * yz - yy * xz];
    let determinant = xx * of_xx + xy * of_xy + xz * of_xz;
    if determinant <= T::ZERO {
        return None;
    }
    let one = T::ONE / determinant;
    let [of_yy, of_yz, of_zz] = [xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy];
    Some((Matrix3::new(of_xx, of_xy, of_xz, of_xy, of_yy, of_yz, of_xz, of_yz, of_zz) * one, determinant))
}
