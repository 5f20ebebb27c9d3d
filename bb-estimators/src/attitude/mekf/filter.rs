//! One step of the filter: strapdown integration with every sample, errors once per window.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::doubt::Doubt;
use super::errors::{BIAS, EAST, Errors, HEADING, NORTH, ROTATION, VELOCITY};
use super::field::{Field, effective_horizontal};
use super::numbers::*;
use super::offset::HardIron;
use super::params::MekfParams;
use super::rest::Rest;
use super::window::Window;
use crate::attitude::initial::heading_error;
use crate::attitude::rotation::{matrix, renormalised, turn, turn_heading, turn_upright};
use crate::attitude::state::AttitudeState;
use crate::attitude::{AttitudeFilter, ImuSample, ParamsError, Real, SampleError};
use crate::params::Params as _;

/// The self-calibrating error-state Kalman filter.
#[derive(Clone, Debug, PartialEq)]
pub struct MekfFilter<T: Real = f64> {
    params: MekfParams,
    state: AttitudeState<T>,
    /// `world_from_body` after the last sample.
    rotation: Matrix3<T>,
    errors: Errors<T>,
    window: Window<T>,
    rest: Rest<T>,
    /// Mean of late of the time between samples, s.
    period: T,
    /// Angular velocity of the last sample, rad/s.
    rate: Vector3<T>,
    /// Means of late of the squares of the angular velocity, rad²/s², of the acceleration, m²/s⁴, and of the horizontal
    /// velocity, m²/s².
    squared_rate: T,
    squared_acceleration: T,
    squared_velocity: T,
    /// Mean of late of the specific force in the world, m/s², and over which time, s.
    force: Vector3<T>,
    force_s: T,
    /// Mean of late of what the field says the heading is off by, rad.
    missed: T,
    doubt: Doubt<T>,
    is_north_known: bool,
    last_field: Vector3<T>,
    field: Option<Field<T>>,
    iron: HardIron<T>,
}

fn square<T: Real>(number: f64) -> T {
    T::of(number * number)
}

/// The smaller of two numbers, neither of which is NaN.
fn least<T: Real>(one: T, other: T) -> T {
    if one < other { one } else { other }
}

impl<T: Real> AttitudeFilter<T> for MekfFilter<T> {
    type Params = MekfParams;

    fn new(params: MekfParams) -> Result<Self, ParamsError> {
        params.check()?;
        let mut errors = Errors::new();
        errors.forget(&BIAS, square(INITIAL_BIAS));
        Ok(Self {
            params,
            state: AttitudeState::new(params.magnetometer.is_used()),
            rotation: Matrix3::identity(),
            errors,
            window: Window::new(),
            rest: Rest::new(&Vector3::zeros(), &Vector3::zeros()),
            rate: Vector3::zeros(),
            period: T::ZERO,
            squared_rate: T::ONE,
            squared_acceleration: T::ZERO,
            squared_velocity: T::ZERO,
            force: Vector3::zeros(),
            force_s: T::ZERO,
            missed: T::ZERO,
            doubt: Doubt::new(),
            is_north_known: false,
            last_field: Vector3::zeros(),
            field: None,
            iron: HardIron::new(params.magnetometer),
        })
    }

    fn params(&self) -> &MekfParams {
        &self.params
    }

    fn update(&mut self, sample: &ImuSample<T>) -> Result<(), SampleError> {
        let (mut dt, mut orientation, has_field) = match self.state.admit_usual(sample) {
            Some(usual) => (usual.dt_s, usual.world_from_body, usual.field.is_some()),
            None => {
                let Some(step) = self.state.admit(sample)? else {
                    self.restart(sample);
                    return Ok(());
                };
                (step.dt_s, step.world_from_body, step.field.is_some())
            }
        };
        let measured = &sample.angular_velocity;
        if self.period == T::ZERO {
            self.period = dt;
        }
        let longest = self.period * T::of(OUTLIER);
        self.iron.age(dt);
        self.period += (least(dt, longest) - self.period) * T::of(PERIOD_GAIN);
        if dt > longest {
            orientation = self.bridge(dt, orientation, measured);
            dt = T::ZERO;
        }
        let rate = measured - self.errors.vector(BIAS);
        orientation = turn(&orientation, &(rate * dt));
        self.rate = rate;
        let squared_rate = rate.norm_squared();
        self.squared_rate += (squared_rate - self.squared_rate) * least(dt * T::of(1.0 / BRIEF_S), T::ONE);
        self.rest.add(dt, measured, &sample.specific_force, &rate);
        let before = self.window.halve(dt);
        self.window.rotation.zip_apply(&self.rotation, |sum, now| *sum += now * before);
        self.rotation = matrix(&orientation);
        let window = &mut self.window;
        window.force += self.rotation * (sample.specific_force * dt);
        if self.rest.is_still() {
            window.measured_turn += measured * dt;
        }
        window.squared_rate += squared_rate * dt;
        if has_field
            && let Some(field) = sample.magnetic_field
            && (field != self.last_field || self.rest.is_detected())
        {
            self.last_field = field;
            orientation = self.add_field(orientation, &rate, &field);
        }
        if self.window.duration >= T::of(WINDOW_S) {
            orientation = self.close_window(orientation);
        }
        self.state.keep(orientation, None);
        Ok(())
    }

    fn start_at(&mut self, time_ns: i64, world_from_body: UnitQuaternion<T>) -> Result<(), SampleError> {
        self.state.start_at(time_ns, world_from_body)?;
        self.is_north_known = true;
        self.begin();
        Ok(())
    }

    fn world_from_body(&self) -> Option<UnitQuaternion<T>> {
        self.state.world_from_body()
    }

    fn gyroscope_bias(&self) -> Option<Vector3<T>> {
        Some(self.errors.vector(BIAS))
    }

    fn orientation_uncertainty(&self) -> Option<Matrix3<T>> {
        self.state.world_from_body()?;
        Some(self.rotation.transpose() * self.uncertainty(T::ZERO) * self.rotation)
    }

    fn is_at_rest(&self) -> Option<bool> {
        Some(self.rest.is_detected())
    }

    fn is_magnetically_disturbed(&self) -> Option<bool> {
        self.params.magnetometer.is_used().then(|| self.field.as_ref().is_some_and(Field::is_disturbed))
    }

    fn is_heading_trusted(&self) -> Option<bool> {
        let is_trusted = self.is_north_known && self.uncertainty(T::of(WITH_TURNS)).m33 < square(TRUSTED);
        self.params.magnetometer.is_used().then_some(is_trusted)
    }

    fn reset(&mut self) {
        if let Ok(new) = Self::new(self.params) {
            *self = new;
        }
    }
}

impl<T: Real> MekfFilter<T> {
    /// The offset of the magnetometer's reading from the field, caused by iron on the body, in the body frame and the
    /// field's unit. Zero until there is evidence for one.
    pub fn magnetometer_offset(&self) -> Vector3<T> {
        self.iron.offset()
    }

    /// Covariance of the rotation error in the world, rad², if this part of the field goes with the angle from pose to pose, 1/rad.
    fn uncertainty(&self, with_turns: T) -> Matrix3<T> {
        let (sin, cos) = T::of(self.params.declination).sin_cos();
        let across = self.rotation.tr_mul(&Vector3::new(cos, -sin, T::ZERO));
        let offset = self.iron.doubt(&across, with_turns);
        self.doubt.covariance(self.errors.block(ROTATION), &self.force, self.missed, offset)
    }

    /// Starts the estimation of errors after a start from a sample, the first one or the one after a gap.
    #[cold]
    fn restart(&mut self, sample: &ImuSample<T>) {
        let Some(orientation) = self.state.world_from_body() else { return };
        self.is_north_known = self.state.heading_is_known();
        if self.is_north_known && self.params.declination != 0.0 {
            let orientation = turn_heading(&orientation, -T::of(self.params.declination));
            self.state.store(&orientation.into_inner(), None);
        }
        self.rest = Rest::new(&sample.angular_velocity, &sample.specific_force);
        self.begin();
    }

    /// Doubts the orientation, and forgets what was in relation to it. What is known of the sensors stays.
    fn begin(&mut self) {
        let Some(orientation) = self.state.world_from_body() else { return };
        self.rotation = matrix(&orientation);
        self.errors.forget(&ROTATION, square(UNKNOWN));
        // Without a magnetometer there is no north to be off from.
        if !self.params.magnetometer.is_used() {
            self.errors.forget(&[HEADING], T::ZERO);
        } else if !self.is_north_known {
            self.errors.forget(&[HEADING], T::of(ANY_ANGLE));
        }
        self.errors.forget(&VELOCITY, square(INITIAL_VELOCITY));
        VELOCITY.iter().for_each(|state| self.errors.value[*state] = T::ZERO);
        self.window = Window::new();
        (self.force, self.force_s) = (Vector3::zeros(), T::ZERO);
        self.missed = T::ZERO;
        self.rest.expect(self.errors.deviation_of_bias());
        self.doubt.begin();
        self.iron.interrupt();
    }

    /// Turns the body over a gap of `dt` seconds, by a rate that fades from those before and after it, and doubts the
    /// orientation by all that it may have turned besides.
    #[cold]
    fn bridge(&mut self, dt: T, orientation: UnitQuaternion<T>, measured: &Vector3<T>) -> UnitQuaternion<T> {
        let orientation = if self.window.duration > T::ZERO { self.close_window(orientation) } else { orientation };
        let mean = (self.rate + measured - self.errors.vector(BIAS)) * T::HALF;
        let lasting = T::of(BRIEF_S) * (T::ONE - (-dt / T::of(BRIEF_S)).exp());
        let orientation = turn(&orientation, &(mean * lasting));
        self.rotation = matrix(&orientation);
        let turned = (self.squared_rate * dt * dt).min(T::of(ANY_ANGLE));
        for state in ROTATION {
            self.errors.doubt(state, turned);
        }
        self.iron.interrupt();
        orientation
    }

    fn add_field(
        &mut self,
        orientation: UnitQuaternion<T>,
        rate: &Vector3<T>,
        field: &Vector3<T>,
    ) -> UnitQuaternion<T> {
        if self.iron.is_due(&self.rotation)
            && let Some(error) = self.iron.observe(&self.rotation, rate, field)
        {
            let horizontal =
                self.field.as_ref().map_or(T::ZERO, Field::horizontal).max(T::of(0.1) * self.iron.scale());
            let ratio = error / horizontal;
            self.errors.doubt(HEADING, (ratio * ratio).min(square(UNKNOWN)));
            self.forget_field();
            self.doubt.forget_mean();
        }
        let in_world = self.rotation * self.iron.field(rate, field);
        if self.is_north_known {
            self.window.add_field(&in_world);
            return orientation;
        }
        let Some(error) = heading_error(&in_world.normalize()) else { return orientation };
        let orientation = turn_heading(&orientation, error - T::of(self.params.declination));
        self.rotation = matrix(&orientation);
        self.errors.forget(&[HEADING], square(UNKNOWN));
        self.is_north_known = true;
        self.window = Window::new();
        self.iron.interrupt();
        orientation
    }

    fn forget_field(&mut self) {
        self.field = None;
        self.window.forget_fields();
        self.doubt.begin();
    }

    /// Ends a window: propagates the errors, and corrects them by what it tells.
    fn close_window(&mut self, orientation: UnitQuaternion<T>) -> UnitQuaternion<T> {
        self.window.rotation += self.rotation * self.window.half;
        let dt = self.window.duration;
        let turned = square::<T>(GYROSCOPE_NOISE) * dt + square::<T>(TURN_NOISE) * self.window.squared_rate;
        self.errors.propagate(&self.window, turned, square::<T>(BIAS_DRIFT) * dt);
        let force = self.window.force / dt;
        if self.is_overturned(dt, &force) {
            return self.level(orientation);
        }
        let acceleration = force - Vector3::z() * T::of(GRAVITY);
        let [east, north] = VELOCITY.map(|state| self.errors.value[state]);
        let part = (dt / T::of(SHORT_S)).min(T::ONE);
        self.squared_acceleration += (acceleration.norm_squared() - self.squared_acceleration) * part;
        self.squared_velocity += (east * east + north * north - self.squared_velocity) * part;
        let squared = square::<T>(VELOCITY_OF_ALL)
            + self.squared_velocity
            + square::<T>(ACCELERATION_LASTS_S) * self.squared_acceleration;
        let variance = T::TWO * T::of(VELOCITY_LASTS_S) * squared / dt;
        let up = self.rotation.row(2).transpose();
        let kept = (!self.params.magnetometer.is_used()).then_some(&up);
        self.errors.correct_one::<EAST>(-east, variance, kept);
        self.errors.correct_one::<NORTH>(-self.errors.value[NORTH], variance, kept);
        let corrected = self.errors.vector(ROTATION).xy();
        self.doubt.correct_tilt(dt, corrected);
        if self.rest.is_detected() {
            self.fuse_rest(dt, &(self.window.measured_turn / dt));
        }
        if self.is_north_known
            && let Some(field) = self.window.mean_field()
        {
            self.fuse_field(dt, &field);
        }
        self.window = Window::new();
        self.rest.expect(self.errors.deviation_of_bias());
        let turned = turn(&UnitQuaternion::identity(), &self.errors.take_rotation());
        let orientation = renormalised(&(turned * orientation));
        self.rotation = matrix(&orientation);
        orientation
    }

    /// Returns whether the tilt is wrong by more than 45°: on average a body does not fall, so the mean force must point up.
    fn is_overturned(&mut self, dt: T, force: &Vector3<T>) -> bool {
        self.force_s = (self.force_s + dt).min(T::of(SHORT_S));
        self.force += (force - self.force) * (dt / self.force_s);
        let norm = self.force.norm();
        norm > T::of(0.5 * GRAVITY) && self.force.z < T::of(OVERTURNED) * norm
    }

    #[cold]
    fn level(&mut self, orientation: UnitQuaternion<T>) -> UnitQuaternion<T> {
        let orientation = turn_upright(&orientation, &self.force);
        self.state.store(&orientation.into_inner(), None);
        self.is_north_known = false;
        let (norm, force_s) = (self.force.norm(), self.force_s);
        self.begin();
        (self.force, self.force_s) = (Vector3::z() * norm, force_s);
        self.forget_field();
        orientation
    }

    /// Corrects the bias by the mean angular velocity, which at rest is the bias.
    fn fuse_rest(&mut self, dt: T, mean: &Vector3<T>) {
        let residual = mean - self.errors.vector(BIAS);
        let known = self.errors.block(BIAS).trace() + T::of(3.0) * square::<T>(REST_BIAS);
        let doubt = (T::of(3.0) * residual.norm_squared() / (known * square::<T>(OUTLIER))).max(T::ONE);
        let variance = square::<T>(REST_BIAS) / dt * doubt;
        self.errors.correct_one::<0>(mean.x - self.errors.value[0], variance, None);
        self.errors.correct_one::<1>(mean.y - self.errors.value[1], variance, None);
        self.errors.correct_one::<2>(mean.z - self.errors.value[2], variance, None);
    }

    /// The angle of the field to north.
    fn fuse_field(&mut self, dt: T, field: &Vector3<T>) {
        let reference = self.field.get_or_insert_with(|| Field::new(field));
        let moved_s = if self.window.squared_rate > square::<T>(FAST) * dt { dt } else { T::ZERO };
        let noise = reference.observe(dt, field, moved_s);
        let horizontal = effective_horizontal(field);
        let (east, north) = (field.x / horizontal, field.y / horizontal);
        let dip = field.z / horizontal;
        let slopes = [(HEADING, T::ONE), (ROTATION[1], -north * dip), (ROTATION[0], -east * dip)];
        let expected: T = slopes.iter().map(|(state, slope)| self.errors.value[*state] * *slope).sum();
        let mut residual = field.x.atan2(field.y) - T::of(self.params.declination) - expected;
        if residual.abs() > T::pi() {
            residual -= T::two_pi() * (residual / T::two_pi()).round();
        }
        let offset = square::<T>(DISTURBANCE) * self.iron.variance() / (horizontal * horizontal);
        let noise = noise + offset;
        // A heading that the field has contradicted for long is not known.
        self.missed += (residual - self.missed) * (dt / T::of(SHORT_S)).min(T::ONE);
        let squared = self.missed * self.missed;
        if squared > square::<T>(CONTRADICTION) + square::<T>(OUTLIER) * self.errors.variance(HEADING) {
            self.errors.doubt(HEADING, squared);
            self.missed = T::ZERO;
            self.forget_field();
            return;
        }
        let variance = self.errors.variance(HEADING);
        self.doubt.correct_heading(dt, field, moved_s, self.missed, variance, noise);
        self.errors.correct_by_field(slopes, residual, noise / dt);
    }
}
