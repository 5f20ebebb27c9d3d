//! One step of Madgwick's filter.

use nalgebra::{UnitQuaternion, Vector3};

use super::MadgwickParams;
use crate::attitude::directions::{expected_up, horizontal_axis, misalignment};
use crate::attitude::rotation::{SERIES_SQUARED_ANGLE, tangent_of_half, turn, turn_by_tangent};
use crate::attitude::sample::Directions;
use crate::attitude::state::{AttitudeState, Usual};
use crate::attitude::{AttitudeFilter, ImuSample, ParamsError, Real, SampleError};
use crate::params::Params as _;

/// Norm below which the gradient is rounding noise without a direction of descent.
const NO_GRADIENT: f64 = 1e-12;

/// Madgwick's gradient-descent filter.
#[derive(Clone, Debug, PartialEq)]
pub struct MadgwickFilter<T: Real = f64> {
    params: MadgwickParams,
    state: AttitudeState<T>,
}

impl<T: Real> AttitudeFilter<T> for MadgwickFilter<T> {
    type Params = MadgwickParams;

    fn new(params: MadgwickParams) -> Result<Self, ParamsError> {
        params.check()?;
        Ok(Self { params, state: AttitudeState::new(params.magnetometer) })
    }

    fn params(&self) -> &MadgwickParams {
        &self.params
    }

    #[inline]
    fn update(&mut self, sample: &ImuSample<T>) -> Result<(), SampleError> {
        match self.state.admit_usual(sample) {
            Some(Usual { dt_s, world_from_body, field: None }) => {
                self.step_to_gravity(&world_from_body, dt_s, sample)
            }
            Some(Usual { dt_s, world_from_body, field: Some(field) }) => {
                self.step_to_field(&world_from_body, dt_s, sample, &field);
            }
            None => return self.update_any(sample),
        }
        Ok(())
    }

    fn start_at(&mut self, time_ns: i64, world_from_body: UnitQuaternion<T>) -> Result<(), SampleError> {
        self.state.start_at(time_ns, world_from_body)
    }

    fn world_from_body(&self) -> Option<UnitQuaternion<T>> {
        self.state.world_from_body()
    }

    fn reset(&mut self) {
        self.state.reset();
    }
}

impl<T: Real> MadgwickFilter<T> {
    #[cold]
    fn update_any(&mut self, sample: &ImuSample<T>) -> Result<(), SampleError> {
        if let Some(step) = self.state.admit(sample)? {
            self.step(&step.world_from_body, step.dt_s, sample, step.up, step.field);
        }
        Ok(())
    }

    /// q̇ = ½ q ⊗ ω - β ∇F/‖∇F‖, and with ∇F = -2 q ⊗ e the second part is a turn at 2 β about e.
    #[inline(always)]
    fn step(
        &mut self,
        before: &UnitQuaternion<T>,
        dt_s: T,
        sample: &ImuSample<T>,
        up: Option<Vector3<T>>,
        field: Option<Vector3<T>>,
    ) {
        let predicted = turn(before, &(sample.angular_velocity * dt_s));
        let Some(up) = up else {
            self.state.store(&predicted, field);
            return;
        };
        let descent = descent(&predicted, &up, field.as_ref());
        self.state.store(&turn_by_tangent(&predicted, &(descent * self.tangent(dt_s))), field);
    }

    /// Makes the step without a field. Neither the predicted quaternion nor the specific force needs unit norm, since
    /// the gradient's norm is irrelevant.
    #[inline(always)]
    fn step_to_gravity(&mut self, before: &UnitQuaternion<T>, dt_s: T, sample: &ImuSample<T>) {
        let squared_angle = sample.angular_velocity.norm_squared() * (dt_s * dt_s);
        let rotation = sample.angular_velocity * (dt_s * tangent_of_half(squared_angle));
        let predicted = turn_by_tangent(before, &rotation);
        let force = &sample.specific_force;
        let error = force.cross(&expected_up(&predicted));
        let squared = error.norm_squared();
        let least = T::above_rounding(NO_GRADIENT);
        if squared_angle < T::of(SERIES_SQUARED_ANGLE) && squared > least * least * force.norm_squared() {
            let tangent = self.tangent(dt_s) / squared.sqrt();
            self.state.store(&turn_by_tangent(&predicted, &(error * tangent)), None);
        } else {
            self.step_far(dt_s, sample);
        }
    }

    /// Makes the step with a field, whose direction is given.
    #[inline(always)]
    fn step_to_field(&mut self, before: &UnitQuaternion<T>, dt_s: T, sample: &ImuSample<T>, field: &Vector3<T>) {
        let squared_angle = sample.angular_velocity.norm_squared() * (dt_s * dt_s);
        let rotation = sample.angular_velocity * (dt_s * tangent_of_half(squared_angle));
        let predicted = turn_by_tangent(before, &rotation);
        let force = &sample.specific_force;
        let up = force * (T::ONE / force.norm_squared().sqrt());
        let (error, _) = misalignment(&predicted, T::ONE + rotation.norm_squared(), &up, Some(field));
        let squared = error.norm_squared();
        let least = T::above_rounding(NO_GRADIENT);
        if squared_angle < T::of(SERIES_SQUARED_ANGLE) && squared > least * least {
            let tangent = self.tangent(dt_s) / squared.sqrt();
            self.state.store(&turn_by_tangent(&predicted, &(error * tangent)), Some(*field));
        } else {
            self.step_far(dt_s, sample);
        }
    }

    /// A rotation that is not small, or an orientation that agrees exactly or not at all.
    #[cold]
    fn step_far(&mut self, dt_s: T, sample: &ImuSample<T>) {
        if let (Some(before), Ok(Directions { up, field })) =
            (self.state.world_from_body(), sample.directions(self.params.magnetometer))
        {
            self.step(&before, dt_s, sample, up, field);
        }
    }

    /// The tangent of half the angle of a step, to the fourth order.
    #[inline(always)]
    fn tangent(&self, dt_s: T) -> T {
        let half = T::of(self.params.beta) * dt_s;
        half * (T::ONE + half * half * (T::of(1.0 / 3.0)))
    }
}

/// The direction, a unit vector in the body frame, about which the body has to turn to descend fastest on
///
/// `F(q) = ½ ‖Rᵀẑ - a‖² + ½ ‖Rᵀb - m‖²`,
///
/// with the measured unit vectors `a` and `m` and the field's reference b (see [`misalignment`], which gives e).
///
/// A turn by the small body vector δ changes `Rᵀv` to `Rᵀv + Rᵀv × δ`, so that
/// `∂F/∂δ = -(a × Rᵀẑ + m × Rᵀb) = -e`. On the unit sphere `dq = ½ q ⊗ δ`, hence `∇F = -2 q ⊗ e`: the
/// papers' `Jᵀ f` less its part along q.
///
/// Zero at the minimum, except at the maximum of F, upside down, which is left about the body's x or y axis.
#[inline(always)]
fn descent<T: Real>(
    world_from_body: &UnitQuaternion<T>,
    up: &Vector3<T>,
    field: Option<&Vector3<T>>,
) -> Vector3<T> {
    let (error, world_up) = misalignment(world_from_body, T::ONE, up, field);
    let squared = error.norm_squared();
    let least = T::above_rounding(NO_GRADIENT);
    if squared > least * least {
        return error * (T::ONE / squared.sqrt());
    }
    if up.dot(&world_up) > T::ZERO {
        return Vector3::zeros();
    }
    horizontal_axis(world_up)
}
