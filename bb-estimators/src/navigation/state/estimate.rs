//! The nominal state to which the errors refer.

use nalgebra::{Matrix3, SVector, UnitQuaternion, Vector3};

use super::states::{
    ACCELEROMETER_BIAS, GYROSCOPE_BIAS, NAVIGATION, Optional, POSITION, PoseErrors, ROTATION, States, VELOCITY,
    offset, pose_errors,
};
use crate::attitude::{MAX_ANGULAR_VELOCITY, MAX_SPECIFIC_FORCE};
use crate::navigation::bounds::{is_on_earth, is_within};
use crate::navigation::math::{Integrals, renormalised, rotation, rotation_vector};
use crate::navigation::numbers::MOST_DELAY_S;
use crate::navigation::refusal::Refusal;

/// Pose at an earlier time, to which relative poses refer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keyframe {
    /// Identifier chosen by the user.
    pub id: u64,
    /// Position in the world, m.
    pub position: Vector3<f64>,
    /// Rotates body coordinates to world coordinates.
    pub world_from_body: UnitQuaternion<f64>,
}

/// The state that a filter estimates, at one instant.
///
/// The world is a local tangent frame, x east, y north, z up; gravity points along -z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate<const N: usize> {
    /// The instant, nanoseconds since any fixed epoch.
    pub time_ns: i64,
    /// Position of the body's origin, the IMU, in the world, m.
    pub position: Vector3<f64>,
    /// Velocity of the body's origin in the world, m/s.
    pub velocity: Vector3<f64>,
    /// Rotates body coordinates to world coordinates.
    pub world_from_body: UnitQuaternion<f64>,
    /// Bias of the accelerometer: its reading minus the specific force, body axes, m/s².
    pub accelerometer_bias: Vector3<f64>,
    /// Bias of the gyroscope: its reading minus the angular velocity, body axes, rad/s.
    pub gyroscope_bias: Vector3<f64>,
    /// Angular velocity over the last sample, bias removed, body axes, rad/s.
    pub angular_velocity: Vector3<f64>,
    /// Specific force over the last sample, bias removed, body axes, m/s².
    pub specific_force: Vector3<f64>,
    /// Acceleration of the body in the world, averaged over the last tenth of a second, m/s².
    pub acceleration: Vector3<f64>,
    /// The keyframe, if one was set and the filter supports keyframes.
    pub keyframe: Option<Keyframe>,
    /// Optional states, at their indices in the error vector.
    pub(in crate::navigation) optional: SVector<f64, N>,
}

impl<const N: usize> Estimate<N> {
    /// An optional scalar state; 0, its nominal value, if the filter `S` does not estimate it.
    pub fn scalar<S: States>(&self, state: Optional) -> f64 {
        offset::<S>(state).map_or(0.0, |index| self.optional[index])
    }

    /// An optional vector state of three numbers; zero if the filter `S` does not estimate it.
    pub fn vector<S: States>(&self, state: Optional) -> Vector3<f64> {
        offset::<S>(state).map_or(Vector3::zeros(), |index| self.optional.fixed_rows::<3>(index).into_owned())
    }

    /// `world_from_body` as a matrix.
    pub fn rotation(&self) -> Matrix3<f64> {
        self.world_from_body.to_rotation_matrix().into_inner()
    }

    /// The estimate with `error` added: the inverse of an error's definition.
    pub fn corrected<S: States>(&self, error: &SVector<f64, N>) -> Self {
        let part = |index: usize| error.fixed_rows::<3>(index).into_owned();
        let turned = |index: usize, q: &UnitQuaternion<f64>| renormalised(&(rotation(&part(index)) * q));
        let mut corrected = *self;
        corrected.position += part(POSITION);
        corrected.velocity += part(VELOCITY);
        corrected.world_from_body = turned(ROTATION, &self.world_from_body);
        corrected.accelerometer_bias += part(ACCELEROMETER_BIAS);
        corrected.gyroscope_bias += part(GYROSCOPE_BIAS);
        corrected.specific_force -= part(ACCELEROMETER_BIAS);
        corrected.angular_velocity -= part(GYROSCOPE_BIAS);
        for i in NAVIGATION..N {
            corrected.optional[i] += error[i];
        }
        if let Some(index) = offset::<S>(Optional::Keyframe) {
            for i in index..index + Optional::Keyframe.dimension() {
                corrected.optional[i] = 0.0;
            }
            if let Some(keyframe) = &mut corrected.keyframe {
                keyframe.position += part(index);
                keyframe.world_from_body = turned(index + 3, &keyframe.world_from_body);
            }
        }
        corrected
    }

    /// The estimate composed with the exponential of an error: `R⁺ = exp(θ) R`, `v⁺ = v + Γ1(θ) δv`, `p⁺ = p + Γ1(θ) δp`, and the
    /// other states by addition. It is the left error of SE₂(3), its axes turned to those of the world; A. Barrau, S. Bonnabel, "The
    /// invariant extended Kalman filter as a stable observer", IEEE Transactions on Automatic Control 62(4), 2017. With the delay of
    /// fixes, δp is that of the delayed position `p - v d`.
    pub(in crate::navigation) fn composed<S: States>(&self, error: &SVector<f64, N>) -> Self {
        let mut additive = *error;
        let part = |first: usize| error.fixed_rows::<3>(first).into_owned();
        for PoseErrors { rotation, turned } in pose_errors::<S>().into_iter().flatten() {
            let turn = part(rotation);
            let integral = Integrals::new(&turn).first_matrix(&turn);
            for first in turned.into_iter().flatten() {
                additive.fixed_rows_mut::<3>(first).copy_from(&(integral * part(first)));
            }
        }
        if let Some(delay) = offset::<S>(Optional::GnssDelay) {
            // What is corrected by addition is the delayed position, see `transport.rs`.
            for i in 0..3 {
                additive[POSITION + i] += additive[VELOCITY + i] * error[delay];
            }
        }
        let mut composed = self.corrected::<S>(&additive);
        if let Some(delay) = offset::<S>(Optional::GnssDelay) {
            composed.optional[delay] = composed.optional[delay].clamp(-MOST_DELAY_S, MOST_DELAY_S);
        }
        composed
    }

    /// The error that takes this estimate to `other`: `self.corrected(&self.error_to(&other))` is `other`, except for stamps and
    /// the last IMU sample.
    pub fn error_to<S: States>(&self, other: &Self) -> SVector<f64, N> {
        let mut error = other.optional - self.optional;
        let mut set = |index: usize, part: Vector3<f64>| error.fixed_rows_mut::<3>(index).copy_from(&part);
        let turn = |from: &UnitQuaternion<f64>, to: &UnitQuaternion<f64>| rotation_vector(&(to * from.inverse()));
        set(POSITION, other.position - self.position);
        set(VELOCITY, other.velocity - self.velocity);
        set(ROTATION, turn(&self.world_from_body, &other.world_from_body));
        set(ACCELEROMETER_BIAS, other.accelerometer_bias - self.accelerometer_bias);
        set(GYROSCOPE_BIAS, other.gyroscope_bias - self.gyroscope_bias);
        if let (Some(index), Some(from), Some(to)) =
            (offset::<S>(Optional::Keyframe), self.keyframe, other.keyframe)
        {
            set(index, to.position - from.position);
            set(index + 3, turn(&from.world_from_body, &to.world_from_body));
        }
        error
    }

    /// Returns this estimate as one of a filter with `M` errors. States that it lacks are dropped, and further ones are zero.
    pub(in crate::navigation) fn resized<const M: usize>(&self) -> Estimate<M> {
        Estimate {
            time_ns: self.time_ns,
            position: self.position,
            velocity: self.velocity,
            world_from_body: self.world_from_body,
            accelerometer_bias: self.accelerometer_bias,
            gyroscope_bias: self.gyroscope_bias,
            angular_velocity: self.angular_velocity,
            specific_force: self.specific_force,
            acceleration: self.acceleration,
            keyframe: self.keyframe,
            optional: SVector::from_fn(|i, _| self.optional.get(i).copied().unwrap_or(0.0)),
        }
    }

    /// An estimate at rest at the origin, as a placeholder to be filled later.
    pub(in crate::navigation) fn unknown() -> Self {
        let zero = Vector3::zeros();
        Self {
            time_ns: 0,
            position: zero,
            velocity: zero,
            world_from_body: UnitQuaternion::identity(),
            accelerometer_bias: zero,
            gyroscope_bias: zero,
            angular_velocity: zero,
            specific_force: zero,
            acceleration: zero,
            keyframe: None,
            optional: SVector::zeros(),
        }
    }

    /// Checks that a filter may start here: every component is finite, and none absurdly large.
    pub(in crate::navigation) fn check(&self) -> Result<(), Refusal> {
        if !self.is_finite() {
            return Err(Refusal::NonFinite);
        }
        let is_plausible = is_on_earth(self.position.iter().chain(&self.velocity))
            && is_within(&self.accelerometer_bias, MAX_SPECIFIC_FORCE)
            && is_within(&self.gyroscope_bias, MAX_ANGULAR_VELOCITY);
        if is_plausible { Ok(()) } else { Err(Refusal::OutOfRange) }
    }

    /// Returns whether no component is NaN.
    pub(in crate::navigation) fn is_finite(&self) -> bool {
        let vectors = [&self.position, &self.velocity, &self.accelerometer_bias, &self.gyroscope_bias];
        vectors.iter().all(|vector| vector.iter().all(|x| x.is_finite()))
            && self.world_from_body.coords.iter().all(|x| x.is_finite())
            && self.optional.iter().all(|x| x.is_finite())
    }
}
