//! One step of Mahony's filter.

use nalgebra::{UnitQuaternion, Vector3};

use super::MahonyParams;
use crate::attitude::directions::{horizontal_axis, misalignment};
use crate::attitude::rotation::turn;
use crate::attitude::state::AttitudeState;
use crate::attitude::{AttitudeFilter, ImuSample, MAX_ANGULAR_VELOCITY, ParamsError, SampleError};

/// Below this squared norm an error upside down is none, which a lean to one side ends.
const NO_ERROR: f64 = 1e-12;

/// The explicit complementary filter with bias correction.
#[derive(Clone, Debug, PartialEq)]
pub struct MahonyFilter {
    params: MahonyParams,
    state: AttitudeState,
    /// rad/s.
    bias: Vector3<f64>,
}

impl AttitudeFilter for MahonyFilter {
    type Params = MahonyParams;

    fn new(params: MahonyParams) -> Result<Self, ParamsError> {
        params.check()?;
        Ok(Self { params, state: AttitudeState::new(params.magnetometer), bias: Vector3::zeros() })
    }

    fn params(&self) -> &MahonyParams {
        &self.params
    }

    fn update(&mut self, sample: &ImuSample) -> Result<(), SampleError> {
        let Some(step) = self.state.admit(sample)? else {
            return Ok(());
        };
        // Ṙ = R [Ω - b + k_P ω_mes]×, ḃ = -k_I ω_mes.
        let mut orientation = turn(&step.world_from_body, &((sample.angular_velocity - self.bias) * step.dt_s));
        if let Some(up) = step.up {
            let (mut error, world_up) = misalignment(&orientation, &up, step.field.as_ref());
            if error.norm_squared() < NO_ERROR && up.dot(&world_up) < 0.0 {
                error = horizontal_axis(&world_up);
            }
            // No angular velocity of a sensor is greater, nor is any bias.
            let bias = self.bias - error * (self.params.integral_gain * step.dt_s);
            self.bias = bias.cap_magnitude(MAX_ANGULAR_VELOCITY);
            let gain = (self.params.proportional_gain * step.dt_s).min(1.0);
            orientation = turn(&orientation, &(error * gain));
        }
        self.state.store(orientation, step.field);
        Ok(())
    }

    fn start_at(&mut self, time_ns: i64, world_from_body: UnitQuaternion<f64>) -> Result<(), SampleError> {
        self.state.start_at(time_ns, world_from_body)
    }

    fn world_from_body(&self) -> Option<UnitQuaternion<f64>> {
        self.state.world_from_body()
    }

    fn gyroscope_bias(&self) -> Option<Vector3<f64>> {
        Some(self.bias)
    }

    fn reset(&mut self) {
        self.state.reset();
        self.bias = Vector3::zeros();
    }
}
