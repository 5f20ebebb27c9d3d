//! One step of Mahony's filter.

use nalgebra::{UnitQuaternion, Vector3};

use super::MahonyParams;
use crate::attitude::directions::{horizontal_axis, misalignment};
use crate::attitude::rotation::{SERIES_SQUARED_ANGLE, renormalised, turn, turn_little};
use crate::attitude::sample::Directions;
use crate::attitude::state::{AttitudeState, Usual};
use crate::attitude::{AttitudeFilter, ImuSample, ParamsError, Real, SampleError};
use crate::params::Params as _;

/// Norm below which an error upside down has no direction of its own: the filter then turns about a horizontal axis.
const NO_ERROR: f64 = 1e-6;

/// The explicit complementary filter with bias correction.
#[derive(Clone, Debug, PartialEq)]
pub struct MahonyFilter<T: Real = f64> {
    params: MahonyParams,
    state: AttitudeState<T>,
    /// rad/s.
    bias: Vector3<T>,
    /// The last sample's error in gravity and field, rad: it turns the orientation until the next sample.
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

    #[inline]
    fn update(&mut self, sample: &ImuSample<T>) -> Result<(), SampleError> {
        let Some(Usual { dt_s, world_from_body: before, field }) = self.state.admit_usual(sample) else {
            return self.update_any(sample);
        };
        let force = &sample.specific_force;
        let up = force * (T::ONE / force.norm_squared().sqrt());
        match &field {
            Some(field) => self.correct(&before, dt_s, sample, &up, Some(field)),
            None => self.correct(&before, dt_s, sample, &up, None),
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
    #[cold]
    fn update_any(&mut self, sample: &ImuSample<T>) -> Result<(), SampleError> {
        let Some(step) = self.state.admit(sample)? else {
            self.error = Vector3::zeros();
            return Ok(());
        };
        self.turn_far(sample, step.dt_s);
        Ok(())
    }

    #[inline(always)]
    fn correct(
        &mut self,
        before: &UnitQuaternion<T>,
        dt_s: T,
        sample: &ImuSample<T>,
        up: &Vector3<T>,
        field: Option<&Vector3<T>>,
    ) {
        // Ṙ = R [Ω - b + k_P ω_mes]×, as one rotation. ω_mes is known in the body frame of the previous sample, so the axis
        // of the correction, not its size, is off by half of what the body turns by in a sample. Errors of the field are
        // large and last, so that with one the axis is put right (Baker, Campbell, Hausdorff).
        let rotation = (sample.angular_velocity - self.bias) * dt_s;
        let turning = if field.is_some() { self.error + self.error.cross(&rotation) * T::HALF } else { self.error };
        let both = rotation + turning * self.gain(dt_s);
        let squared = both.norm_squared();
        if squared < T::of(SERIES_SQUARED_ANGLE) {
            self.compare(turn_little(before, &both, squared), dt_s, up, field);
        } else {
            self.turn_far(sample, dt_s);
        }
    }

    /// Corrects and then rotates, each exactly, in the rare cases: a rotation that is not small, free fall, the first
    /// field.
    #[cold]
    fn turn_far(&mut self, sample: &ImuSample<T>, dt_s: T) {
        let (Some(before), Ok(Directions { up, field })) =
            (self.state.world_from_body(), sample.directions(self.params.magnetometer))
        else {
            return;
        };
        let rotation = (sample.angular_velocity - self.bias) * dt_s;
        let corrected = turn(&before, &(self.error * self.gain(dt_s)));
        let turned = renormalised(&turn(&corrected, &rotation));
        // Do not re-apply the first heading reset: it is neither an error nor a bias.
        let is_first_field = field.is_some() && !self.state.heading_is_known();
        match up {
            Some(up) if !is_first_field => self.compare(turned, dt_s, &up, field.as_ref()),
            _ => {
                self.error = Vector3::zeros();
                self.state.keep(turned, field);
            }
        }
    }

    /// The fraction of an error corrected in `dt_s`: at most 1, however late the sample or large the gain.
    #[inline(always)]
    fn gain(&self, dt_s: T) -> T {
        let gain = T::of(self.params.proportional_gain) * dt_s;
        if gain < T::ONE { gain } else { T::ONE }
    }

    /// ḃ = -k_I ω_mes, and ω_mes for the next sample.
    #[inline(always)]
    fn compare(&mut self, orientation: UnitQuaternion<T>, dt_s: T, up: &Vector3<T>, field: Option<&Vector3<T>>) {
        let (mut error, world_up) = misalignment(&orientation, T::ONE, up, field);
        if error.x.abs() < T::of(NO_ERROR) && error.norm() < T::of(NO_ERROR) && up.dot(&world_up) < T::ZERO {
            error = horizontal_axis(world_up);
        }
        self.bias -= error * (T::of(self.params.integral_gain) * dt_s);
        self.error = error;
        self.state.keep(orientation, field.copied());
    }
}
