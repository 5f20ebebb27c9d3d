//! One step of Mahony's filter.

use nalgebra::{UnitQuaternion, Vector3};

use super::MahonyParams;
use crate::attitude::directions::{horizontal_axis, misalignment};
use crate::attitude::rotation::turn_unit;
use crate::attitude::state::{AttitudeState, Step};
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
    /// What the last sample missed gravity and field by, rad: it turns the orientation until the next sample.
    error: Vector3<T>,
}

impl<T: Real> AttitudeFilter<T> for MahonyFilter<T> {
    type Params = MahonyParams;

    fn new(params: MahonyParams) -> Result<Self, ParamsError> {
        params.check()?;
        Ok(Self {
            params,
            state: AttitudeState::new(params.magnetometer),
            bias: Vector3::zeros(),
            error: Vector3::zeros(),
        })
    }

    fn params(&self) -> &MahonyParams {
        &self.params
    }

    fn update(&mut self, sample: &ImuSample<T>) -> Result<(), SampleError> {
        let Some(step) = self.state.admit(sample)? else {
            self.error = Vector3::zeros();
            return Ok(());
        };
        // A path for each, so that neither carries what the other needs.
        match (&step.up, &step.field) {
            (Some(up), Some(field)) => self.correct(&step, &sample.angular_velocity, up, Some(field)),
            (Some(up), None) => self.correct(&step, &sample.angular_velocity, up, None),
            (None, _) => self.coast(sample, step.dt_s),
        }
        Ok(())
    }

    fn start_at(&mut self, time_ns: i64, world_from_body: UnitQuaternion<T>) -> Result<(), SampleError> {
        self.state.start_at(time_ns, world_from_body)?;
        self.error = Vector3::zeros();
        Ok(())
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
        self.error = Vector3::zeros();
    }
}

impl<T: Real> MahonyFilter<T> {
    #[inline(always)]
    fn correct(
        &mut self,
        step: &Step<T>,
        angular_velocity: &Vector3<T>,
        up: &Vector3<T>,
        field: Option<&Vector3<T>>,
    ) {
        let orientation = turn_unit(&step.world_from_body, &self.rotation(angular_velocity, step.dt_s));
        let (mut error, world_up) = misalignment(&orientation, up, field);
        if error.x.abs() < T::of(NO_ERROR) && error.norm() < T::of(NO_ERROR) && up.dot(&world_up) < T::ZERO {
            error = horizontal_axis(world_up);
        }
        self.bias -= error * (T::of(self.params.integral_gain) * step.dt_s);
        self.error = error;
        self.state.keep(orientation, field.copied());
    }

    /// A step by the gyroscope alone.
    #[cold]
    fn coast(&mut self, sample: &ImuSample<T>, dt_s: T) {
        let rotation = self.rotation(&sample.angular_velocity, dt_s);
        self.error = Vector3::zeros();
        self.state.turn(&rotation, sample);
    }

    /// Ṙ = R [Ω - b + k_P ω_mes]×, ḃ = -k_I ω_mes: what the body turns by in `dt_s`, rad.
    ///
    /// First by the correction, which is known in the body frame of the sample before, and then by the gyroscope: of
    /// the two turns in one the first three terms (Baker, Campbell, Hausdorff).
    #[inline(always)]
    fn rotation(&self, angular_velocity: &Vector3<T>, dt_s: T) -> Vector3<T> {
        // Not beyond what was missed, however late the sample or large the gain.
        let gain = T::of(self.params.proportional_gain) * dt_s;
        let gain = if gain < T::ONE { gain } else { T::ONE };
        let rotation = (angular_velocity - self.bias) * dt_s;
        let correction = self.error * gain;
        rotation + correction + (correction * T::HALF).cross(&rotation)
    }
}
