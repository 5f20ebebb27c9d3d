//! Offset of the magnetometer, by iron on the body: the one that is subtracted, and another that may replace it.

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::numbers::{
    ANY_OFFSET, CALIBRATED, FIELD_WALK, FIRST_POSES, LATER_ODDS, LEAST_WALK, NEWCOMER_POSES, ODDS, PLACES,
    POSE_TURN, SCALE_TURN, SHARPER, SHORT_S, TAILS,
};
use super::params::Magnetometer;
use crate::attitude::Real;

/// One hypothesis: the world's field walks from pose to pose, with the steps of Student's distribution, and the body
/// adds an offset. In units of the field.
#[derive(Clone, Debug, PartialEq)]
struct Hypothesis<T: Real> {
    field: Vector3<T>,
    offset: Vector3<T>,
    /// Covariance of field and offset.
    covariance: SMatrix<T, 6, 6>,
    /// Scale of a step, squared, as learnt.
    step: T,
    poses: T,
}

impl<T: Real> Hypothesis<T> {
    fn new(deviation: f64) -> Self {
        let mut covariance = SMatrix::<T, 6, 6>::zeros();
        covariance.fixed_view_mut::<3, 3>(3, 3).fill_diagonal(T::of(deviation * deviation));
        let step = T::of(FIELD_WALK * FIELD_WALK);
        Self { field: Vector3::zeros(), offset: Vector3::zeros(), covariance, step, poses: T::ZERO }
    }

    fn of_offset(&self) -> Matrix3<T> {
        self.covariance.fixed_view::<3, 3>(3, 3).into_owned()
    }

    /// Begins with a pose: nothing is known of the world's field but what this field tells.
    fn begin(&mut self, rotation: &Matrix3<T>, measured: &Vector3<T>) {
        self.field = measured - rotation * self.offset;
        let of_offset = self.of_offset();
        let across = rotation * of_offset;
        let of_field = across * rotation.transpose() + Matrix3::from_diagonal_element(self.step);
        self.covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(&of_field);
        self.covariance.fixed_view_mut::<3, 3>(0, 3).copy_from(&-across);
        self.covariance.fixed_view_mut::<3, 3>(3, 0).copy_from(&-across.transpose());
    }

    /// Adds the next pose, with the field measured in it in the world frame. Returns the logarithm of its likelihood.
    fn observe(&mut self, rotation: &Matrix3<T>, measured: &Vector3<T>) -> T {
        let residual = measured - self.field - rotation * self.offset;
        // A step and an error of the magnetometer have one scale.
        let (walk, white) = (self.step, self.step);
        let shared = |covariance: &SMatrix<T, 6, 6>| {
            covariance.fixed_columns::<3>(0) + covariance.fixed_columns::<3>(3) * rotation.transpose()
        };
        let expected = |shared: &SMatrix<T, 6, 3>| {
            shared.fixed_rows::<3>(0) + rotation * shared.fixed_rows::<3>(3) + Matrix3::from_diagonal_element(white)
        };
        let mut with = shared(&self.covariance);
        let total = expected(&with) + Matrix3::from_diagonal_element(walk);
        let Some(inverse) = total.try_inverse() else { return T::ZERO };
        let squared = residual.dot(&(inverse * residual));
        let (tails, freedom) = (T::of(TAILS), T::of(TAILS + 3.0));
        let likelihood = -T::HALF * total.determinant().ln() - T::HALF * freedom * (squared / tails).ln_1p();
        let weight = freedom / (tails + squared);
        self.poses += T::ONE;
        let learnt = weight * squared / T::of(3.0) - T::ONE;
        self.step *= T::ONE + learnt / (self.poses + T::of(FIRST_POSES));
        self.step = self.step.max(T::of(LEAST_WALK * LEAST_WALK));
        // A step that is too large for the scale is one, rather than an error of the sensor.
        let walked = walk / weight.min(T::ONE);
        for axis in 0..3 {
            self.covariance[(axis, axis)] += walked;
            with[(axis, axis)] += walked;
        }
        let Some(inverse) = expected(&with).try_inverse() else { return T::ZERO };
        let gain = with * inverse;
        let correction = gain * residual;
        self.field += correction.fixed_rows::<3>(0);
        self.offset += correction.fixed_rows::<3>(3);
        for row in 0..6 {
            for column in row..6 {
                let known: T = (0..3).map(|axis| gain[(row, axis)] * with[(column, axis)]).sum();
                let covariance = self.covariance[(row, column)] - known;
                self.covariance[(row, column)] = covariance;
                self.covariance[(column, row)] = covariance;
            }
        }
        likelihood
    }

    /// Variance of the offset along an axis, as the poses tell it.
    fn variance(&self) -> T {
        self.of_offset().trace() / T::of(3.0)
    }

    /// Variance of the offset along an axis, with what the field's changes from place to place look like.
    fn doubt(&self) -> T {
        self.variance() + T::of(PLACES * PLACES)
    }

    /// The offset, as far as it is larger than its deviation.
    ///
    /// An estimate of variance `σ²` along each axis, of an offset of unknown variance `τ²`, has the mean square `3 (τ² + σ²)`;
    /// the part `τ² / (τ² + σ²)` of it is the offset. B. Efron, C. Morris, "Stein's estimation rule and its competitors: an
    /// empirical Bayes approach", Journal of the American Statistical Association 68, 1973.
    fn believed(&self) -> Vector3<T> {
        let (squared, unknown) = (self.offset.norm_squared(), T::of(3.0) * self.doubt());
        if squared > unknown { self.offset * (T::ONE - unknown / squared) } else { Vector3::zeros() }
    }
}

/// A pose with the field measured in it, body frame.
#[derive(Clone, Debug, PartialEq)]
struct Pose<T: Real> {
    rotation: Matrix3<T>,
    field: Vector3<T>,
    age_s: T,
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
    /// Poses that the newcomer has seen.
    seen: T,
    /// `true` if the user has stated that the magnetometer is calibrated, so that there is no newcomer.
    is_calibrated: bool,
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
            seen: T::ZERO,
            is_calibrated: magnetometer == Magnetometer::Calibrated,
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

    /// Variance of the offset along an axis.
    pub(super) fn variance(&self) -> T {
        self.incumbent.variance() * self.scale() * self.scale()
    }

    /// Expected square of the error of the offset along an axis, as a fraction of the field's norm. The newcomer's offset is the true
    /// one with the odds so far, which are even at first.
    pub(super) fn doubt(&self) -> T {
        let known = self.incumbent.doubt();
        if self.is_calibrated {
            return known;
        }
        let moved = (self.newcomer.offset - self.incumbent.believed()).norm_squared() / T::of(3.0);
        let odds = (self.odds + T::of(ODDS)).min(T::ZERO).exp();
        known + (moved + self.newcomer.variance()) * odds / (T::ONE + odds)
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

    /// Adds a field. Poses in one field show an offset by how it turns, whatever the heading.
    ///
    /// Returns by how much the heading so far was wrong for the offset, in the unit of the field, when another offset is
    /// found, or the same is known much better than when this was said before.
    pub(super) fn observe(&mut self, rotation: &Matrix3<T>, field: &Vector3<T>) -> Option<T> {
        let Some(pose) = &self.pose else {
            self.begin(rotation, field);
            return None;
        };
        // Twice the versine of the angle between the poses, for a small angle its square.
        let squared_turn = T::of(3.0) - rotation.dot(&pose.rotation);
        if pose.age_s > T::of(SHORT_S) {
            self.begin(rotation, field);
            return None;
        }
        if squared_turn < T::of(POSE_TURN * POSE_TURN) {
            return None;
        }
        let Some(scale) = self.scale else {
            // Of a field in any direction, two thirds turn.
            self.changed += (field - pose.field).norm_squared();
            self.turned += squared_turn * T::of(2.0 / 3.0);
            if self.turned > T::of(SCALE_TURN * SCALE_TURN) && self.changed > T::ZERO {
                self.scale = Some((self.changed / self.turned).sqrt());
            }
            self.begin(rotation, field);
            return None;
        };
        self.pose = Some(Pose { rotation: *rotation, field: *field, age_s: T::ZERO });
        let measured = rotation * (field / scale);
        let of_incumbent = self.incumbent.observe(rotation, &measured);
        self.offset = self.incumbent.believed() * scale;
        if !self.is_calibrated {
            self.odds += self.newcomer.observe(rotation, &measured) - of_incumbent;
            self.seen += T::ONE;
            let moved = (self.newcomer.offset - self.incumbent.believed()).norm_squared();
            let variance = self.newcomer.variance();
            if self.odds > T::ZERO && variance < moved {
                let newcomer = self.another(rotation, &measured);
                self.incumbent = core::mem::replace(&mut self.newcomer, newcomer);
                self.offset = self.incumbent.believed() * scale;
                self.doubted = variance.sqrt();
                return Some((moved + variance).sqrt() * scale);
            }
            if self.seen > T::of(NEWCOMER_POSES) && self.odds < -T::of(ODDS) {
                self.newcomer = self.another(rotation, &measured);
            }
        }
        let deviation = self.incumbent.variance().sqrt();
        if deviation < T::of(SHARPER) * self.doubted {
            return Some(scale * core::mem::replace(&mut self.doubted, deviation));
        }
        None
    }

    /// A newcomer that begins with this pose.
    fn another(&mut self, rotation: &Matrix3<T>, measured: &Vector3<T>) -> Hypothesis<T> {
        self.odds = -T::of(LATER_ODDS);
        self.seen = T::ZERO;
        let mut newcomer = Hypothesis::new(ANY_OFFSET);
        newcomer.step = self.incumbent.step;
        newcomer.begin(rotation, measured);
        newcomer
    }

    fn begin(&mut self, rotation: &Matrix3<T>, field: &Vector3<T>) {
        self.pose = Some(Pose { rotation: *rotation, field: *field, age_s: T::ZERO });
        if let Some(scale) = self.scale {
            let measured = rotation * (field / scale);
            self.incumbent.begin(rotation, &measured);
            self.newcomer.begin(rotation, &measured);
        }
    }
}
