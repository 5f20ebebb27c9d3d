//! One step of the Kalman filter: strapdown with every sample, the errors once a window.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::errors::{BIAS, CALIBRATION, Errors, FORCE_LATENCY, ProcessNoise, ROTATION, VELOCITY};
use super::field::{FieldReference, Verdict, in_plane};
use super::iron::{Adoption, FieldMeans, HardIron};
use super::measurement::{Heading, Measurements};
use super::params::MekfParams;
use super::rest::Rest;
use super::vertical::{Contradiction, Vertical};
use super::window::Window;
use crate::attitude::initial::heading_error;
use crate::attitude::rotation::{turn, turn_heading, turn_upright};
use crate::attitude::state::AttitudeState;
use crate::attitude::{AttitudeFilter, ImuSample, ParamsError, Real, SampleError};
use crate::params::Params as _;

/// Standard deviation of the tilt that one accelerometer sample shows in motion, rad. At rest it is forgotten
/// within a second.
pub(super) const INITIAL_TILT: f64 = 0.35;

/// Standard deviation of an orientation that was given, about every axis, rad.
const GIVEN: f64 = 0.087;

/// Standard deviation of the velocity at the start, m/s: a hand, a pedestrian.
const INITIAL_VELOCITY: f64 = 1.0;

/// Standard deviation of the heading that one magnetic sample shows indoors, rad.
const INITIAL_HEADING: f64 = 1.0;

/// How long a velocity lasts, s: the pseudo-measurement of zero has errors correlated over twice this time.
const VELOCITY_TIME_S: f64 = 0.5;

/// Time constant of the mean square acceleration, s.
const ACCELERATION_TIME_CONSTANT_S: f64 = 2.0;

/// Velocity at rest, in a mean over a second, m/s: the table trembles.
const REST_VELOCITY: f64 = 0.05;

/// Noise of the accelerometer, of its scale and of the lever arm's rotation, m/s/√s.
const ACCELEROMETER_NOISE: f64 = 0.02;

/// What the gyroscope's mean over a second at rest may differ from its bias by, rad/s: 0.07°/s.
const REST_BIAS: f64 = 1.2e-3;

/// A bias at rest this many standard deviations off has stepped.
const BIAS_STEP: f64 = 4.0;

/// The greatest difference to the bias that rest is believed for, rad/s: 2°/s, VQF's `biasClip`.
const MAX_REST_BIAS: f64 = 0.035;

/// How long a disturbance of the field lasts for a body that moves, s.
const FIELD_TIME_S: f64 = 0.5;

/// A heading that is known from before is turned to the field beyond this difference, rad, and two standard deviations.
const REOPENED: f64 = 0.15;

/// A heading known up to this standard deviation is trusted, rad: 10°.
const TRUSTED_HEADING: f64 = 0.175;

/// A heading this far from an undisturbed field contradicts it, rad and standard deviations.
const CONTRADICTION: f64 = 0.35;
const CONTRADICTION_DEVIATIONS: f64 = 4.0;

/// The self-calibrating error-state Kalman filter.
#[derive(Clone, Debug, PartialEq)]
pub struct MekfFilter<T: Real = f64> {
    params: MekfParams,
    state: AttitudeState<T>,
    heading_known: bool,
    /// rad/s.
    bias: Vector3<T>,
    /// What `angular_velocity` has to lose beyond the bias, as a fraction of itself.
    calibration: Matrix3<T>,
    /// `world_from_body` after the last sample.
    rotation: Matrix3<T>,
    errors: Errors<T>,
    window: Window<T>,
    measurements: Measurements<T>,
    rest: Rest<T>,
    field: Option<FieldReference<T>>,
    iron: HardIron<T>,
    last_field: Vector3<T>,
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
            last_field: Vector3::zeros(),
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
        let measured = &sample.angular_velocity;
        let rate = measured - self.bias - self.calibration * measured;
        let mut orientation = turn(&step.world_from_body, &(rate * step.dt_s));

        let bias_deviation = self.errors.variance(BIAS).max(T::ZERO).sqrt();
        self.rest.add(step.dt_s, measured, &sample.specific_force, &self.bias, bias_deviation);
        let before = core::mem::replace(&mut self.rotation, *orientation.to_rotation_matrix().matrix());
        let middle = (before + self.rotation) * T::HALF;
        self.window.add_rate(step.dt_s, &middle, measured);
        let rotation = if self.params.force_is_mean { &middle } else { &self.rotation };
        self.window.add_force(step.dt_s, rotation, &rate, &sample.specific_force);
        if step.field.is_some()
            && let Some(field) = sample.magnetic_field
            && (field != self.last_field || self.rest.is_detected())
        {
            // A driver that is faster than the magnetometer repeats its last value, which is then a stale one.
            self.window.add_field(&self.rotation, &rate, &field, &self.iron.offset);
            self.last_field = field;
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

    /// As of the last window's end, at most 0.1 s ago. Without a magnetometer the heading's own variance is 0: it is
    /// right by definition at the start, and what it drifts by since is in here.
    fn orientation_uncertainty(&self) -> Option<Matrix3<T>> {
        self.state.world_from_body()?;
        let mut in_world = self.errors.block(ROTATION);
        in_world[(2, 2)] += self.iron.heading_variance();
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
        let variance = self.errors.variance(ROTATION + 2) + self.iron.heading_variance();
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
    /// The gyroscope's scale and misalignment errors: what it reads is `(1 + E)` times the angular velocity and
    /// the bias, for small E.
    pub fn gyroscope_calibration(&self) -> Matrix3<T> {
        self.calibration
    }

    /// What the magnetometer reads beside the field: by iron on the body, in the body frame and the field's unit. Zero
    /// as long as nothing speaks for another.
    pub fn magnetometer_offset(&self) -> Vector3<T> {
        self.iron.offset
    }

    /// Covariance of the offset in the body frame, the field's unit squared, by what was seen since the offset or the
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

    /// After a start from a sample, the first one or the one after a gap.
    #[cold]
    fn restart(&mut self, sample: &ImuSample<T>) {
        let Some(orientation) = self.state.world_from_body() else {
            return;
        };
        let direction = sample.magnetic_field.filter(|_| self.params.magnetometer).map(|field| field.normalize());
        self.heading_known = direction.is_some_and(|direction| heading_error(&(orientation * direction)).is_some());
        self.rest = Rest::new(&sample.angular_velocity, &sample.specific_force);
        self.last_field = sample.magnetic_field.unwrap_or_default();
        self.begin(&orientation, T::of(INITIAL_TILT), T::of(INITIAL_HEADING));
        self.vertical = Vertical::new(true);
    }

    /// Resets the orientation's errors; what is known of the sensors stays.
    fn begin(&mut self, orientation: &UnitQuaternion<T>, tilt_deviation: T, heading_deviation: T) {
        // Without a magnetometer there is no heading to be wrong.
        let heading_deviation = if self.params.magnetometer { heading_deviation } else { T::ZERO };
        // All of a window or nothing: one horizontal axis alone would depend on where north is.
        while self.measurements.take(&mut self.errors) {}
        self.correct();
        self.errors.mean[VELOCITY..VELOCITY + 2].fill(T::ZERO);
        self.errors.forget::<2>(ROTATION, tilt_deviation * tilt_deviation);
        self.errors.forget::<1>(ROTATION + 2, heading_deviation * heading_deviation);
        self.errors.forget::<2>(VELOCITY, T::of(INITIAL_VELOCITY * INITIAL_VELOCITY));
        self.rotation = *orientation.to_rotation_matrix().matrix();
        self.window = Window::new();
        self.measurements = Measurements::none();
        self.vertical = Vertical::new(false);
        self.iron.begin(true);
    }

    /// Doubts what is known of the sensors as at the start.
    fn forget_sensors(&mut self) {
        let params = &self.params;
        self.errors.forget::<3>(BIAS, T::of(params.initial_bias * params.initial_bias));
        self.errors.forget::<9>(CALIBRATION, T::of(params.calibration_error * params.calibration_error));
        let latency = T::of(params.accelerometer_latency);
        self.errors.forget::<1>(FORCE_LATENCY, latency * latency);
    }

    /// Ends a window: takes the errors to now, corrects by them, and looks at what the window says.
    fn close_window(&mut self, orientation: UnitQuaternion<T>) -> UnitQuaternion<T> {
        while self.measurements.take(&mut self.errors) {}
        let window = core::mem::replace(&mut self.window, Window::new());
        let (params, dt) = (&self.params, window.duration);
        let rotation_noise = T::of(params.gyroscope_noise * params.gyroscope_noise) * dt
            + T::of(params.gyroscope_rate_noise * params.gyroscope_rate_noise) * window.squared_rate;
        self.errors.propagate(
            &window,
            &ProcessNoise {
                rotation: rotation_noise,
                bias: T::of(params.bias_drift * params.bias_drift) * dt,
                velocity: T::of(ACCELEROMETER_NOISE * ACCELEROMETER_NOISE) * dt,
            },
        );
        if !self.errors.are_sane() {
            return self.recover(orientation);
        }

        let correction = self.correct();
        let orientation = correction * orientation;
        self.rotation = *orientation.to_rotation_matrix().matrix();
        let force = correction * window.force;
        match self.vertical.add(dt, &correction, &force) {
            Some(Contradiction::Start(up, deviation)) => return self.level_start(orientation, &up, deviation),
            Some(Contradiction::Tilt(up)) => return self.level(orientation, &up),
            None => {}
        }
        self.iron.correct(&correction);
        let fields = window.mean_field(&correction);
        let adoption = fields
            .as_ref()
            .and_then(|fields| self.iron.observe(dt, fields, self.rest.is_detected(), self.field.as_ref()));
        self.measure(dt, fields.as_ref(), &force);
        match adoption {
            Some(adoption) => self.adopt(orientation, &adoption),
            None => orientation,
        }
    }

    /// Moves the mean errors into what they are errors of; returns the rotation.
    fn correct(&mut self) -> UnitQuaternion<T> {
        let mean = &mut self.errors.mean;
        let rotation = Vector3::new(mean[ROTATION], mean[ROTATION + 1], mean[ROTATION + 2]);
        for i in 0..3 {
            self.bias[i] += mean[BIAS + i];
            for k in 0..3 {
                self.calibration[(i, k)] += mean[CALIBRATION + 3 * i + k];
            }
        }
        mean[..CALIBRATION + 9].fill(T::ZERO);
        turn(&UnitQuaternion::identity(), &rotation)
    }

    /// Looks at what a window says, for the samples of the next one to take.
    fn measure(&mut self, dt: T, fields: Option<&FieldMeans<T>>, force: &Vector3<T>) {
        let resting = self.rest.is_detected();
        let squared = (force.x * force.x + force.y * force.y) / (dt * dt);
        let gain = (dt / T::of(ACCELERATION_TIME_CONSTANT_S)).min(T::ONE);
        self.squared_acceleration += (squared - self.squared_acceleration) * gain;
        let velocity_variance = if resting {
            T::of(REST_VELOCITY * REST_VELOCITY) / dt
        } else {
            let growth = T::of(self.params.acceleration_time * self.params.acceleration_time);
            let squared = T::of(self.params.velocity * self.params.velocity) + growth * self.squared_acceleration;
            squared * T::TWO * T::of(VELOCITY_TIME_S) / dt
        };
        let bias = resting.then(|| self.rest_bias(dt));
        let heading = fields.map(|fields| self.heading(dt, fields));
        self.measurements = Measurements::new(velocity_variance, heading, bias);
    }

    /// What the gyroscope reads at rest is its bias.
    fn rest_bias(&mut self, dt: T) -> (Vector3<T>, T) {
        let difference = self.rest.rate - self.bias;
        let squared = difference.norm_squared();
        let expected = self.errors.variance(BIAS) + T::of(REST_BIAS * REST_BIAS);
        if squared > T::of(BIAS_STEP * BIAS_STEP) * expected {
            for axis in 0..3 {
                self.errors.doubt(BIAS + axis, squared);
            }
        }
        let most = (T::of(MAX_REST_BIAS * MAX_REST_BIAS) / squared.max(T::of(1e-12))).min(T::ONE).sqrt();
        (difference * most, T::of(REST_BIAS * REST_BIAS) / dt)
    }

    /// What the field says about the heading, less the offset and the lag.
    fn heading(&mut self, dt: T, fields: &FieldMeans<T>) -> Heading<T> {
        let FieldMeans { rotation, field, rate } = fields;
        let field = field - rotation * self.iron.offset - rate * self.iron.lag();
        let plane = in_plane(&field);
        let squared = plane[0] * plane[0];
        let reference = self.field.get_or_insert_with(|| FieldReference::new(plane));
        let angle = field.x.atan2(field.y);
        let deviation = self.errors.variance(ROTATION + 2).max(T::ZERO).sqrt();
        let contradicts = angle.abs() > T::of(CONTRADICTION).max(T::of(CONTRADICTION_DEVIATIONS) * deviation);
        let disturbance = match reference.observe(dt, plane, contradicts) {
            Verdict::Disturbed(variance) => variance,
            Verdict::HeadingUnknown => {
                self.errors.doubt(ROTATION + 2, angle * angle);
                T::ZERO
            }
        };
        let horizontal = reference.horizontal();
        let usual = T::of(self.params.field_disturbance * self.params.field_disturbance);
        let least = T::of(0.25) * horizontal * horizontal * reference.squared_norm();
        let rate = (rate.x * field.y - rate.y * field.x) / squared.max(least);
        // What is not known of the offset, across the field, as a fraction of its norm.
        let across = rotation.tr_mul(&Vector3::new(field.y, -field.x, T::ZERO)) / squared.max(least).sqrt();
        let unknown = across.dot(&(self.iron.covariance() * across)) / reference.squared_norm();
        let disturbed = T::TWO * T::of(FIELD_TIME_S) * (usual + disturbance + unknown) / (horizontal * horizontal);
        Heading {
            angle,
            slope: reference.vertical() / horizontal,
            variance: disturbed / dt + rate * rate * self.iron.lag_variance(),
        }
    }

    /// Takes an offset that the field has shown, and the heading where the fields are all that shows it.
    #[cold]
    fn adopt(&mut self, orientation: UnitQuaternion<T>, adoption: &Adoption<T>) -> UnitQuaternion<T> {
        let Adoption { field, variance, is_heading, is_other_field, duration } = adoption;
        // What the window says about the heading was with the offset before.
        self.measurements.forget_heading();
        if *is_heading || *is_other_field {
            self.field = Some(FieldReference::seen(in_plane(field), *duration));
        }
        let Some(angle) = heading_error(&field.normalize()) else { return orientation };
        let known = self.errors.variance(ROTATION + 2) + *variance;
        let is_evident = angle.abs() > T::of(REOPENED) && angle * angle > T::of(4.0) * known;
        if !is_heading && !is_evident {
            return orientation;
        }
        let turned = turn_heading(&orientation, angle);
        let rotation = turn_heading(&UnitQuaternion::identity(), angle);
        let (sin, cos) = angle.sin_cos();
        self.errors.turn_heading([cos, sin]);
        self.errors.doubt(ROTATION + 2, if *is_heading { *variance } else { *variance + angle * angle });
        self.vertical.turn(&rotation);
        self.iron.turn(&rotation);
        self.rotation = *turned.to_rotation_matrix().matrix();
        turned
    }

    /// The body accelerated at the start: levels it by the mean specific force since, known up to `deviation`, rad.
    /// The heading is that of the last field; what is known of the sensors stays.
    #[cold]
    fn level_start(&mut self, orientation: UnitQuaternion<T>, up: &Vector3<T>, deviation: T) -> UnitQuaternion<T> {
        let mut orientation = turn_upright(&orientation, up);
        if self.params.magnetometer
            && let Some(field) = self.last_field.try_normalize(T::ZERO)
            && let Some(error) = heading_error(&(orientation * field))
        {
            orientation = turn_heading(&orientation, error);
            self.field = None;
        }
        let vertical = self.vertical.clone();
        self.begin(&orientation, deviation, T::of(INITIAL_HEADING));
        self.vertical = vertical;
        self.vertical.levelled();
        orientation
    }

    /// The tilt contradicts the mean specific force: restarts it, and the heading with the next field.
    #[cold]
    fn level(&mut self, orientation: UnitQuaternion<T>, up: &Vector3<T>) -> UnitQuaternion<T> {
        let orientation = turn_upright(&orientation, up);
        self.begin(&orientation, T::of(INITIAL_TILT), T::of(INITIAL_HEADING));
        self.forget_sensors();
        self.heading_known = !self.params.magnetometer;
        self.field = None;
        orientation
    }

    /// Numbers beyond all reason came in, and no knowledge is left: restarts from the orientation.
    #[cold]
    fn recover(&mut self, orientation: UnitQuaternion<T>) -> UnitQuaternion<T> {
        let (state, heading_known) = (self.state.clone(), self.heading_known);
        self.reset();
        (self.state, self.heading_known) = (state, heading_known);
        self.begin(&orientation, T::of(INITIAL_TILT), T::of(INITIAL_HEADING));
        orientation
    }
}
