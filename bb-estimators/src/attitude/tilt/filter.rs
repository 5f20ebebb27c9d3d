//! One step of the filter without a gyroscope.

use nalgebra::{UnitQuaternion, Vector3};

use super::TiltParams;
use crate::attitude::initial::{FREE_FALL, heading_error};
use crate::attitude::low_pass::gain;
use crate::attitude::rotation::{turn_heading, turn_upright};
use crate::attitude::state::AttitudeState;
use crate::attitude::{AttitudeFilter, ImuSample, MAX_GAP_S, ParamsError, SampleError};

/// Inclination from gravity, heading from the magnetic field.
#[derive(Clone, Debug, PartialEq)]
pub struct TiltFilter {
    params: TiltParams,
    state: AttitudeState,
    /// Low-passed, m/s², body frame.
    force: Option<Vector3<f64>>,
    /// Low-passed, in the field's own unit, body frame.
    field: Option<Vector3<f64>>,
    /// Time since the last specific force that was not free fall, and since the last field, at most [`MAX_GAP_S`].
    since_force_s: f64,
    since_field_s: f64,
}

impl AttitudeFilter for TiltFilter {
    type Params = TiltParams;

    fn new(params: TiltParams) -> Result<Self, ParamsError> {
        params.check()?;
        let state = AttitudeState::new(params.magnetometer);
        Ok(Self { params, state, force: None, field: None, since_force_s: 0.0, since_field_s: 0.0 })
    }

    fn params(&self) -> &TiltParams {
        &self.params
    }

    fn update(&mut self, sample: &ImuSample) -> Result<(), SampleError> {
        let step = self.state.admit(sample)?;
        let Some(step) = step else {
            self.begin();
            self.force = Some(sample.specific_force).filter(|force| force.norm_squared() > FREE_FALL * FREE_FALL);
            self.field = sample.magnetic_field.filter(|_| self.state.heading_is_known());
            return Ok(());
        };
        let mut orientation = step.world_from_body;
        self.since_force_s = (self.since_force_s + step.dt_s).min(MAX_GAP_S);
        self.since_field_s = (self.since_field_s + step.dt_s).min(MAX_GAP_S);
        if step.up.is_some() {
            let gain = gain(core::mem::take(&mut self.since_force_s), self.params.time_constant);
            let force = approach(&mut self.force, &sample.specific_force, gain);
            if force.norm_squared() > FREE_FALL * FREE_FALL {
                orientation = turn_upright(&orientation, &(orientation * force));
            }
        }
        if step.field.is_some()
            && let Some(field) = &sample.magnetic_field
        {
            let gain = gain(core::mem::take(&mut self.since_field_s), self.params.time_constant);
            let field = approach(&mut self.field, field, gain);
            if let Some(field) = field.try_normalize(0.0)
                && let Some(error) = heading_error(&(orientation * field))
            {
                orientation = turn_heading(&orientation, error);
            }
        }
        self.state.store(&orientation, step.field);
        Ok(())
    }

    fn start_at(&mut self, time_ns: i64, world_from_body: UnitQuaternion<f64>) -> Result<(), SampleError> {
        self.state.start_at(time_ns, world_from_body)?;
        self.begin();
        Ok(())
    }

    fn world_from_body(&self) -> Option<UnitQuaternion<f64>> {
        self.state.world_from_body()
    }

    fn reset(&mut self) {
        self.state.reset();
        self.begin();
    }
}

impl TiltFilter {
    /// Lets the low-passes begin with the next sample.
    fn begin(&mut self) {
        self.force = None;
        self.field = None;
        self.since_force_s = 0.0;
        self.since_field_s = 0.0;
    }
}

/// One step of a low-pass that begins with its first input.
fn approach(mean: &mut Option<Vector3<f64>>, value: &Vector3<f64>, gain: f64) -> Vector3<f64> {
    let mean = mean.get_or_insert(*value);
    *mean += (value - *mean) * gain;
    *mean
}
