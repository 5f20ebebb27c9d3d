//! One step of Madgwick's filter.

use nalgebra::{UnitQuaternion, Vector3};

use super::MadgwickParams;
use crate::attitude::directions::{horizontal_axis, misalignment};
use crate::attitude::rotation::{turn, turn_by_tangent};
use crate::attitude::state::AttitudeState;
use crate::attitude::{AttitudeFilter, ImuSample, ParamsError, Real, SampleError};
use crate::params::Params as _;

/// Below this norm the gradient is rounding noise, which has no direction to descend in.
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

    fn update(&mut self, sample: &ImuSample<T>) -> Result<(), SampleError> {
        let Some(step) = self.state.admit(sample)? else {
            return Ok(());
        };
        // q̇ = ½ q ⊗ ω - β ∇F/‖∇F‖, and with ∇F = -2 q ⊗ e the second part is a turn at 2 β about e.
        let predicted = turn(&step.world_from_body, &(sample.angular_velocity * step.dt_s));
        let Some(up) = step.up else {
            self.state.store(&predicted, step.field);
            return Ok(());
        };
        let descent = descent(&predicted, &up, step.field.as_ref());
        // The tangent of half the angle, to the fourth order.
        let half = T::of(self.params.beta) * step.dt_s;
        let tangent = half * (T::ONE + half * half * (T::of(1.0 / 3.0)));
        self.state.store(&turn_by_tangent(&predicted, &(descent * tangent)), step.field);
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
/// Zero where there is nothing to gain, except at the top of F, upside down, which is left about the body's
/// x or y axis.
#[inline]
fn descent<T: Real>(
    world_from_body: &UnitQuaternion<T>,
    up: &Vector3<T>,
    field: Option<&Vector3<T>>,
) -> Vector3<T> {
    let (error, world_up) = misalignment(world_from_body, up, field);
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
