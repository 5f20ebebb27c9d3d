//! One step of the complementary filter.

use nalgebra::{UnitQuaternion, Vector3};

use super::ComplementaryParams;
use crate::attitude::initial::heading_error;
use crate::attitude::low_pass::gain;
use crate::attitude::rotation::{turn, turn_heading, turn_upright};
use crate::attitude::state::AttitudeState;
use crate::attitude::{AttitudeFilter, ImuSample, MAX_GAP_S, ParamsError, Real, SampleError};
use crate::params::Params as _;

/// Standard gravity, m/s².
const GRAVITY: f64 = 9.80665;

/// Squared tangent below which upside down is an equilibrium, which a lean to one side ends.
const UPSIDE_DOWN: f64 = 1e-6;

/// The complementary filter on quaternions.
#[derive(Clone, Debug, PartialEq)]
pub struct ComplementaryFilter<T: Real = f64> {
    params: ComplementaryParams,
    state: AttitudeState<T>,
    /// Time since the heading was last corrected, at most [`MAX_GAP_S`]: a magnetometer may be slower than the
    /// gyroscope, and its gain is the one of its own period.
    since_field_s: T,
}

impl<T: Real> AttitudeFilter<T> for ComplementaryFilter<T> {
    type Params = ComplementaryParams;

    fn new(params: ComplementaryParams) -> Result<Self, ParamsError> {
        params.check()?;
        Ok(Self { params, state: AttitudeState::new(params.magnetometer), since_field_s: T::ZERO })
    }

    fn params(&self) -> &ComplementaryParams {
        &self.params
    }

    fn update(&mut self, sample: &ImuSample<T>) -> Result<(), SampleError> {
        let Some(step) = self.state.admit(sample)? else {
            self.since_field_s = T::ZERO;
            return Ok(());
        };
        let mut orientation = turn(&step.world_from_body, &(sample.angular_velocity * step.dt_s));
        if step.up.is_some() {
            let gain = gain(step.dt_s, T::of(self.params.tilt_time_constant));
            orientation = correct_tilt(&orientation, &sample.specific_force, gain);
        }
        self.since_field_s = (self.since_field_s + step.dt_s).min(T::of(MAX_GAP_S));
        if let Some(field) = step.field
            && let Some(error) = heading_error(&(orientation * field))
        {
            let gain = gain(self.since_field_s, T::of(self.params.heading_time_constant));
            orientation = turn_heading(&orientation, gain * error);
            self.since_field_s = T::ZERO;
        }
        self.state.store(&orientation, step.field);
        Ok(())
    }

    fn start_at(&mut self, time_ns: i64, world_from_body: UnitQuaternion<T>) -> Result<(), SampleError> {
        self.state.start_at(time_ns, world_from_body)?;
        self.since_field_s = T::ZERO;
        Ok(())
    }

    fn world_from_body(&self) -> Option<UnitQuaternion<T>> {
        self.state.world_from_body()
    }

    fn reset(&mut self) {
        self.state.reset();
        self.since_field_s = T::ZERO;
    }
}

/// One step of the low-pass on the specific force in the world frame, and the rotation that makes its output vertical
/// again.
///
/// The low-pass is `u ← (1 - gain) u + gain f`. Before the step, u is vertical, because the previous step turned the
/// world that way, and has the length of gravity, so it needs no memory. It averages vectors, not angles: the
/// accelerations of any motion are zero in the mean, but their directions are not.
fn correct_tilt<T: Real>(
    world_from_body: &UnitQuaternion<T>,
    specific_force: &Vector3<T>,
    gain: T,
) -> UnitQuaternion<T> {
    let mut force = world_from_body * specific_force;
    if force.z < T::ZERO && force.x * force.x + force.y * force.y < T::of(UPSIDE_DOWN) * force.z * force.z {
        force.y = force.y - force.z;
    }
    let up = Vector3::new(gain * force.x, gain * force.y, gain * force.z + (T::ONE - gain) * T::of(GRAVITY));
    turn_upright(world_from_body, &up)
}
