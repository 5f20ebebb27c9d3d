//! One step of the Kalman filter: strapdown integration with every sample, errors once per window.

mod heading;
mod start;
mod windows;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::INITIAL_TILT;
use super::errors::Errors;
use super::field::FieldReference;
use super::iron::{Adoption, HardIron};
use super::measurement::Measurements;
use super::params::MekfParams;
use super::rest::Rest;
use super::states::{BIAS, ROTATION};
use super::vertical::Vertical;
use super::window::Window;
use crate::attitude::initial::heading_error;
use crate::attitude::rotation::{turn, turn_heading};
use crate::attitude::state::AttitudeState;
use crate::attitude::{AttitudeFilter, ImuSample, ParamsError, Real, SampleError};
use crate::params::Params as _;

/// Standard deviation of a given orientation, about every axis, rad.
const GIVEN: f64 = 0.087;

/// Standard deviation of the heading from one magnetic sample indoors, rad.
const INITIAL_HEADING: f64 = 1.0;

/// A faster angular velocity is a rotation, rad/s: 2°/s, as in the detection of rest.
const TURNING: f64 = 0.035;

/// A heading known up to this standard deviation is trusted, rad: 10°.
const TRUSTED_HEADING: f64 = 0.175;

/// The self-calibrating error-state Kalman filter.
#[derive(Clone, Debug, PartialEq)]
pub struct MekfFilter<T: Real = f64> {
    params: MekfParams,
    state: AttitudeState<T>,
    heading_known: bool,
    /// rad/s.
    bias: Vector3<T>,
    /// Correction of `angular_velocity` beyond the bias, as a fraction of itself.
    calibration: Matrix3<T>,
    /// `world_from_body` after the last sample.
    rotation: Matrix3<T>,
    errors: Errors<T>,
    window: Window<T>,
    measurements: Measurements<T>,
    rest: Rest<T>,
    field: Option<FieldReference<T>>,
    iron: HardIron<T>,
    /// Shown by the last window; takes effect with the next sample, since the end of a window is work enough.
    adoption: Option<Adoption<T>>,
    last_field: Vector3<T>,
    /// Whether the body has turned since that was measured.
    last_field_is_stale: bool,
    squared_acceleration: T,
    vertical: Vertical<T>,
}

impl<T: Real> AttitudeFilter<T> for MekfFilter<T> {
    type Params = MekfParams;

    fn new(params: MekfParams) -> Result<Self, ParamsError> {
        params.check()?;
        let mut filter = Self {
            params,
            state: AttitudeState::new(params.magnetometer),
            heading_known: false,
            bias: Vector3::zeros(),
            calibration: Matrix3::zeros(),
            rotation: Matrix3::identity(),
            errors: Errors::new(),
            window: Window::new(),
            measurements: Measurements::none(),
            rest: Rest::new(&Vector3::zeros(), &Vector3::zeros()),
            field: None,
            iron: HardIron::new(params.magnetometer_latency),
            adoption: None,
            last_field: Vector3::zeros(),
            last_field_is_stale: false,
            squared_acceleration: T::ZERO,
            vertical: Vertical::new(false),
        };
        filter.forget_sensors();
        Ok(filter)
    }

    fn params(&self) -> &MekfParams {
        &self.params
    }

    fn update(&mut self, sample: &ImuSample<T>) -> Result<(), SampleError> {
        let Some(step) = self.state.admit(sample)? else {
            self.restart(sample);
            return Ok(());
        };
        let previous = match self.adoption.take() {
            Some(adoption) => self.adopt(step.world_from_body, &adoption),
            None => step.world_from_body,
        };
        let measured = &sample.angular_velocity;
        let rate = measured - self.bias - self.calibration * measured;
        let mut orientation = turn(&previous, &(rate * step.dt_s));

        let bias_deviation = self.errors.variance(BIAS).max(T::ZERO).sqrt();
        self.rest.add(step.dt_s, measured, &sample.specific_force, &self.bias, bias_deviation);
        self.last_field_is_stale |= rate.norm_squared() > T::of(TURNING * TURNING);
        let before = core::mem::replace(&mut self.rotation, *orientation.to_rotation_matrix().matrix());
        let middle = (before + self.rotation) * T::HALF;
        self.window.add_rate(step.dt_s, &middle, measured);
        let rotation = if self.params.force_is_mean { &middle } else { &self.rotation };
        self.window.add_force(step.dt_s, rotation, &rate, &sample.specific_force);
        if step.field.is_some()
            && let Some(field) = sample.magnetic_field
            && self.is_present(&field)
        {
            self.window.add_field(&self.rotation, &rate, &field, &self.iron.offset);
        }

        if self.window.is_full() {
            orientation = self.close_window(orientation);
        } else {
            self.measurements.take(&mut self.errors);
        }
        if !self.heading_known
            && let Some(direction) = step.field
            && let Some(error) = heading_error(&(orientation * direction))
        {
            orientation = turn_heading(&orientation, error);
            self.begin(&orientation, T::of(INITIAL_TILT), T::of(INITIAL_HEADING));
            self.heading_known = true;
        }
        self.state.store(&orientation, step.field);
        Ok(())
    }

    fn start_at(&mut self, time_ns: i64, world_from_body: UnitQuaternion<T>) -> Result<(), SampleError> {
        self.state.start_at(time_ns, world_from_body)?;
        self.heading_known = true;
        if let Some(orientation) = self.state.world_from_body() {
            self.begin(&orientation, T::of(GIVEN), T::of(GIVEN));
            self.iron.begin(false);
        }
        Ok(())
    }

    fn world_from_body(&self) -> Option<UnitQuaternion<T>> {
        self.state.world_from_body()
    }

    fn gyroscope_bias(&self) -> Option<Vector3<T>> {
        Some(self.bias)
    }

    /// At the end of the last window, at most 0.1 s ago. Without a magnetometer, the heading's own variance is 0: it
    /// is right by definition at the start, and its drift since then is included. With one, the variance of the heading
    /// includes an unknown offset of the magnetometer and, as far as norm and dip show it, a slow drift of the field.
    fn orientation_uncertainty(&self) -> Option<Matrix3<T>> {
        self.state.world_from_body()?;
        let mut in_world = self.errors.block(ROTATION);
        in_world[(2, 2)] += self.field_heading_variance();
        Some(self.rotation.transpose() * in_world * self.rotation)
    }

    fn is_at_rest(&self) -> Option<bool> {
        Some(self.rest.is_detected())
    }

    /// By norm and dip: a field that differs from the reference by more than a tenth of its norm.
    fn is_magnetically_disturbed(&self) -> Option<bool> {
        self.params.magnetometer.then(|| self.field.as_ref().is_some_and(FieldReference::is_disturbed))
    }

    /// Up to a standard deviation of 10°. An unknown offset of the magnetometer is part of it: a sensor that has not
    /// turned since the start has no heading to be trusted.
    fn is_heading_trusted(&self) -> Option<bool> {
        let variance = self.errors.variance(ROTATION + 2) + self.field_heading_variance();
        let is_trusted = self.heading_known && variance < T::of(TRUSTED_HEADING * TRUSTED_HEADING);
        self.params.magnetometer.then_some(is_trusted)
    }

    fn reset(&mut self) {
        if let Ok(new) = Self::new(self.params) {
            *self = new;
        }
    }
}

impl<T: Real> MekfFilter<T> {
    /// Whether a field is one of the present orientation. A driver that is faster than the magnetometer repeats the last
    /// value, and so does a magnetometer that hangs; at rest, a value that was measured since the last turn may repeat.
    fn is_present(&mut self, field: &Vector3<T>) -> bool {
        if *field != self.last_field {
            self.last_field = *field;
            self.last_field_is_stale = false;
            return true;
        }
        self.rest.is_detected() && !self.last_field_is_stale
    }

    /// The gyroscope's scale and misalignment errors: its reading is `(1 + E)` times the angular velocity and the
    /// bias, for small E.
    pub fn gyroscope_calibration(&self) -> Matrix3<T> {
        self.calibration
    }

    /// The offset of the magnetometer's reading from the field, caused by iron on the body, in the body frame and the
    /// field's unit. Zero until there is evidence for another value.
    pub fn magnetometer_offset(&self) -> Vector3<T> {
        self.iron.offset
    }

    /// Covariance of the offset in the body frame, the field's unit squared, from the data since the offset or the
    /// field last changed.
    pub fn magnetometer_offset_uncertainty(&self) -> Matrix3<T> {
        self.iron.offset_covariance()
    }

    /// How much the magnetometer lags the gyroscope, s.
    pub fn magnetometer_latency(&self) -> T {
        self.iron.lag()
    }

    /// Variance of that, s².
    pub fn magnetometer_latency_variance(&self) -> T {
        self.iron.lag_variance()
    }

    /// Covariance of the gyroscope's bias, body frame, (rad/s)².
    pub fn gyroscope_bias_uncertainty(&self) -> Matrix3<T> {
        self.errors.block(BIAS)
    }
}
