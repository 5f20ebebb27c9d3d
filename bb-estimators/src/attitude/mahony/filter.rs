//! One step of Mahony's filter.

use nalgebra::{UnitQuaternion, Vector3};

use super::MahonyParams;
use crate::attitude::directions::{horizontal_axis, misalignment};
use crate::attitude::rotation::{turn, turn_by_tangent};
use crate::attitude::state::AttitudeState;
use crate::attitude::{AttitudeFilter, ImuSample, ParamsError, Real, SampleError};

/// Below this norm an error upside down is none, which a lean to one side ends.
const NO_ERROR: f64 = 1e-6;

/// The explicit complementary filter with bias correction.
#[derive(Clone, Debug, PartialEq)]
pub struct MahonyFilter<T: Real = f64> {
    params: MahonyParams,
    state: AttitudeState<T>,
    /// rad/s.
    bias: Vector3<T>,
}

impl<T: Real> AttitudeFilter<T> for MahonyFilter<T> {
    type Params = MahonyParams;

    fn new(params: MahonyParams) -> Result<Self, ParamsError> {
        params.check()?;
        Ok(Self { params, state: AttitudeState::new(params.magnetometer), bias: Vector3::zeros() })
    }

    fn params(&self) -> &MahonyParams {
        &self.params
    }

    fn update(&mut self, sample: &ImuSample<T>) -> Result<(), SampleError> {
        let Some(step) = self.state.admit(sample)? else {
            return Ok(());
        };
        // Ṙ = R [Ω - b + k_P ω_mes]×, ḃ = -k_I ω_mes.
        let predicted = turn(&step.world_from_body, &((sample.angular_velocity - self.bias) * step.dt_s));
        let Some(up) = step.up else {
            self.state.store(&predicted, step.field);
            return Ok(());
        };
        let (mut error, world_up) = misalignment(&predicted, &up, step.field.as_ref());
        if error.x.abs() < T::of(NO_ERROR) && error.norm() < T::of(NO_ERROR) && up.dot(&world_up) < T::ZERO {
            error = horizontal_axis(&world_up);
        }
        self.bias -= error * (T::of(self.params.integral_gain) * step.dt_s);
        let half = T::HALF * T::of(self.params.proportional_gain) * step.dt_s;
        let half = if half < T::HALF { half } else { T::HALF };
        self.state.store(&turn_by_tangent(&predicted, &(error * half)), step.field);
        Ok(())
    }

    fn start_at(&mut self, time_ns: i64, world_from_body: UnitQuaternion<T>) -> Result<(), SampleError> {
        self.state.start_at(time_ns, world_from_body)
    }

    fn world_from_body(&self) -> Option<UnitQuaternion<T>> {
        self.state.world_from_body()
    }

    fn gyroscope_bias(&self) -> Option<Vector3<T>> {
        Some(self.bias)
    }

    fn reset(&mut self) {
        self.state.reset();
        self.bias = Vector3::zeros();
    }
}
