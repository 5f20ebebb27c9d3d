//! One step of the filter without a gyroscope.

use nalgebra::{UnitQuaternion, Vector3};

use super::TiltParams;
use crate::attitude::initial::heading_error;
use crate::attitude::low_pass::gain;
use crate::attitude::rotation::{turn_heading, turn_upright};
use crate::attitude::sample::FREE_FALL;
use crate::attitude::state::AttitudeState;
use crate::attitude::{AttitudeFilter, ImuSample, MAX_GAP_S, ParamsError, Real, SampleError};
use crate::params::Params as _;

/// A filter that takes the inclination from gravity and the heading from the magnetic field.
#[derive(Clone, Debug, PartialEq)]
pub struct TiltFilter<T: Real = f64> {
    params: TiltParams,
    state: AttitudeState<T>,
    /// Low-passed specific force, m/s², body frame.
    force: Option<Vector3<T>>,
    /// Low-passed magnetic field, in its own unit, body frame.
    field: Option<Vector3<T>>,
    /// Time since the last specific force that was not free fall, and since the last field, at most [`MAX_GAP_S`].
    since_force_s: T,
    since_field_s: T,
}

impl<T: Real> AttitudeFilter<T> for TiltFilter<T> {
    type Params = TiltParams;

    fn new(params: TiltParams) -> Result<Self, ParamsError> {
        params.check()?;
        let state = AttitudeState::new(params.magnetometer);
        Ok(Self { params, state, force: None, field: None, since_force_s: T::ZERO, since_field_s: T::ZERO })
    }

    fn params(&self) -> &TiltParams {
        &self.params
    }

    fn update(&mut self, sample: &ImuSample<T>) -> Result<(), SampleError> {
        let step = self.state.admit(sample)?;
        let Some(step) = step else {
            self.begin();
            self.force =
                Some(sample.specific_force).filter(|force| force.norm_squared() > T::of(FREE_FALL * FREE_FALL));
            self.field = sample.magnetic_field.filter(|_| self.state.heading_is_known());
            return Ok(());
        };
        let mut orientation = step.world_from_body;
        self.since_force_s = (self.since_force_s + step.dt_s).min(T::of(MAX_GAP_S));
        self.since_field_s = (self.since_field_s + step.dt_s).min(T::of(MAX_GAP_S));
        if step.up.is_some() {
            let gain = gain(core::mem::take(&mut self.since_force_s), T::of(self.params.time_constant));
            let force = approach(&mut self.force, &sample.specific_force, gain);
            if force.norm_squared() > T::of(FREE_FALL * FREE_FALL) {
                orientation = turn_upright(&orientation, &(orientation * force));
            }
        }
        if step.field.is_some()
            && let Some(field) = &sample.magnetic_field
        {
            let gain = gain(core::mem::take(&mut self.since_field_s), T::of(self.params.time_constant));
            let field = approach(&mut self.field, field, gain);
            if let Some(field) = field.try_normalize(T::ZERO)
                && let Some(error) = heading_error(&(orientation * field))
            {
                orientation = turn_heading(&orientation, error);
            }
        }
        self.state.store(&orientation, step.field);
        Ok(())
    }

    fn start_at(&mut self, time_ns: i64, world_from_body: UnitQuaternion<T>) -> Result<(), SampleError> {
        self.state.start_at(time_ns, world_from_body)?;
        self.begin();
        Ok(())
    }

    fn world_from_body(&self) -> Option<UnitQuaternion<T>> {
        self.state.world_from_body()
    }

    fn reset(&mut self) {
        self.state.reset();
        self.begin();
    }
}

impl<T: Real> TiltFilter<T> {
    /// Restarts the low-passes with the next sample.
    fn begin(&mut self) {
        self.force = None;
        self.field = None;
        self.since_force_s = T::ZERO;
        self.since_field_s = T::ZERO;
    }
}

/// One step of a low-pass that is initialised by its first input.
fn approach<T: Real>(mean: &mut Option<Vector3<T>>, value: &Vector3<T>, gain: T) -> Vector3<T> {
    let mean = mean.get_or_insert(*value);
    *mean += (value - *mean) * gain;
    *mean
}
