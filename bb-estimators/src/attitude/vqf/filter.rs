//! One step of VQF.

use nalgebra::{UnitQuaternion, Vector3};

use super::VqfParams;
use super::bias::Bias;
use super::coefficients::{FieldCoefficients, InertialCoefficients};
use super::field::Disturbance;
use super::heading::Heading;
use super::low_pass::LowPass;
use super::rest::Rest;
use crate::attitude::rotation::{renormalised, turn, turn_upright};
use crate::attitude::state::AttitudeState;
use crate::attitude::{AttitudeFilter, ImuSample, MAX_GAP_S, ParamsError, Real, SampleError};
use crate::params::Params as _;

/// Standard gravity, m/s².
const GRAVITY: f64 = 9.80665;

/// Squared norm, (m/s²)², below which a mean specific force does not show which way is up.
const NO_FORCE: f64 = 1e-12;

/// The initial sample time of the coefficients, s; the first samples change it.
const USUAL_DT_S: f64 = 0.01;

/// The versatile quaternion-based filter.
#[derive(Clone, Debug, PartialEq)]
pub struct VqfFilter<T: Real = f64> {
    params: VqfParams,
    state: AttitudeState<T>,
    inertial_from_body: UnitQuaternion<T>,
    level_from_inertial: UnitQuaternion<T>,
    heading: Heading<T>,
    /// Specific force in the inertial frame, m/s².
    forces: LowPass<T, 3>,
    rest: Rest<T>,
    bias: Bias<T>,
    disturbance: Disturbance<T>,
    /// Time since the last field, at most [`MAX_GAP_S`].
    since_field_s: T,
    coefficients: InertialCoefficients<T>,
    field_coefficients: FieldCoefficients<T>,
}

impl<T: Real> AttitudeFilter<T> for VqfFilter<T> {
    type Params = VqfParams;

    fn new(params: VqfParams) -> Result<Self, ParamsError> {
        params.check()?;
        Ok(Self {
            params,
            state: AttitudeState::new(params.magnetometer),
            inertial_from_body: UnitQuaternion::identity(),
            level_from_inertial: UnitQuaternion::identity(),
            heading: Heading::new(T::ONE),
            forces: LowPass::new(),
            rest: Rest::new(),
            bias: Bias::new(&params),
            disturbance: Disturbance::new(&params),
            since_field_s: T::ZERO,
            coefficients: InertialCoefficients::new(&params, T::of(USUAL_DT_S)),
            field_coefficients: FieldCoefficients::new(&params, T::of(USUAL_DT_S)),
        })
    }

    fn params(&self) -> &VqfParams {
        &self.params
    }

    fn update(&mut self, sample: &ImuSample<T>) -> Result<(), SampleError> {
        let Some(step) = self.state.admit(sample)? else {
            let mean_gain = if self.state.heading_is_known() { T::HALF } else { T::ONE };
            self.begin(Heading::new(mean_gain), LowPass::new());
            self.average_first(sample);
            return Ok(());
        };
        self.coefficients.follow(&self.params, step.dt_s);
        self.strapdown(step.dt_s, &sample.angular_velocity);
        let level_from_body = if step.up.is_some() {
            self.incline(step.dt_s, &sample.specific_force)
        } else {
            self.level_from_inertial * self.inertial_from_body
        };
        self.since_field_s = (self.since_field_s + step.dt_s).min(T::of(MAX_GAP_S));
        if let (Some(direction), Some(field)) = (&step.field, &sample.magnetic_field) {
            self.turn_north(field.dot(direction), &(level_from_body * direction));
        }
        self.state.store(&self.heading.world_from(&level_from_body), step.field);
        Ok(())
    }

    fn start_at(&mut self, time_ns: i64, world_from_body: UnitQuaternion<T>) -> Result<(), SampleError> {
        self.state.start_at(time_ns, world_from_body)?;
        self.begin(Heading::new(T::ZERO), LowPass::settled([T::ZERO, T::ZERO, T::of(GRAVITY)]));
        Ok(())
    }

    fn world_from_body(&self) -> Option<UnitQuaternion<T>> {
        self.state.world_from_body()
    }

    fn gyroscope_bias(&self) -> Option<Vector3<T>> {
        (self.params.rest_bias || self.params.motion_bias).then_some(self.bias.bias)
    }

    fn is_at_rest(&self) -> Option<bool> {
        Some(self.rest.is_detected())
    }

    /// Returns whether the field is disturbed; it counts as such before the first reference has been seen in motion for long enough.
    fn is_magnetically_disturbed(&self) -> Option<bool> {
        let watched = self.params.magnetometer && self.params.disturbance_rejection;
        watched.then_some(self.disturbance.is_detected())
    }

    fn reset(&mut self) {
        if let Ok(new) = Self::new(self.params) {
            *self = new;
        }
    }
}

impl<T: Real> VqfFilter<T> {
    /// Starts from the state's orientation, if it has one; the estimates of the gyroscope and of the field are kept.
    #[cold]
    fn begin(&mut self, heading: Heading<T>, forces: LowPass<T, 3>) {
        if let Some(orientation) = self.state.world_from_body() {
            self.inertial_from_body = orientation;
        }
        self.level_from_inertial = UnitQuaternion::identity();
        self.heading = heading;
        self.forces = forces;
        self.rest = Rest::new();
        self.bias.forget_motion();
        self.disturbance.forget_motion();
        self.since_field_s = T::ZERO;
    }

    /// Initialises the means of the low-passes with the sample that started the filter.
    #[cold]
    fn average_first(&mut self, sample: &ImuSample<T>) {
        let (coefficients, level_from_body) = (&self.coefficients, &self.inertial_from_body);
        self.rest.average_first(coefficients, &sample.angular_velocity, &sample.specific_force);
        self.forces.filter(&(level_from_body * sample.specific_force).into(), T::ZERO, &coefficients.tilt);
        self.bias.low_pass(T::ZERO, coefficients, level_from_body.to_rotation_matrix().matrix());
    }

    /// Integrates the gyroscope minus its bias.
    #[inline]
    fn strapdown(&mut self, dt_s: T, measured: &Vector3<T>) {
        self.rest.add_rate(&self.params, dt_s, &self.coefficients, measured);
        let turned = turn(&self.inertial_from_body, &((measured - self.bias.bias) * dt_s));
        self.inertial_from_body = renormalised(&turned);
    }

    /// Corrects the inclination by the specific force, and the bias by that; returns the orientation without the
    /// heading.
    #[inline]
    fn incline(&mut self, dt_s: T, force: &Vector3<T>) -> UnitQuaternion<T> {
        let (params, coefficients) = (&self.params, &self.coefficients);
        self.rest.add_force(params, dt_s, coefficients, force);
        let inertial = self.inertial_from_body * force;
        let mean: Vector3<T> = self.forces.filter(&inertial.into(), dt_s, &coefficients.tilt).into();
        let leaning = self.level_from_inertial * mean;
        let squared = leaning.norm_squared();
        if squared <= T::of(NO_FORCE) {
            return self.level_from_inertial * self.inertial_from_body;
        }
        let leaning = leaning * (T::ONE / squared.sqrt());
        self.level_from_inertial = renormalised(&turn_upright(&self.level_from_inertial, &leaning));

        let level_from_body = self.level_from_inertial * self.inertial_from_body;
        let rotation = level_from_body.to_rotation_matrix();
        let rotation = rotation.matrix();
        if params.rest_bias && self.rest.is_detected() {
            self.bias.low_pass(dt_s, coefficients, rotation);
            self.bias.rest(params, coefficients, &self.rest.rate);
        } else if params.motion_bias {
            self.bias.motion(params, dt_s, coefficients, &leaning, rotation);
        }
        level_from_body
    }

    /// Corrects the heading by a field of this norm and direction in the level frame.
    #[inline]
    fn turn_north(&mut self, norm: T, direction: &Vector3<T>) {
        let (params, dt_s) = (&self.params, self.since_field_s);
        self.field_coefficients.follow(params, dt_s);
        self.since_field_s = T::ZERO;
        let coefficients = &self.field_coefficients;
        let trust = if params.disturbance_rejection {
            let least = T::of(params.new_field_angular_velocity);
            let turning = self.rest.rate.norm_squared() >= least * least;
            self.disturbance.observe(params, dt_s, coefficients, norm, direction, turning)
        } else {
            T::ONE
        };
        self.heading.correct(dt_s, T::of(params.heading_time_constant), coefficients, direction, trust);
    }
}
