//! What every filter remembers, and how it starts, steps and restarts.

use nalgebra::{Quaternion, Unit, UnitQuaternion, Vector3};

use super::initial::{FREE_FALL, heading_error};
use super::rotation::{normalised, turn_heading, turn_upright};
use super::{ImuSample, Quantity, SampleError};

/// The longest time between two samples that a filter integrates over, seconds.
///
/// Over a second a hand turns a sensor by more than half a turn, which no single angular velocity describes.
/// After a longer gap the tilt starts anew from the accelerometer.
pub const MAX_GAP_S: f64 = 1.0;

const MAX_GAP_NS: i64 = (MAX_GAP_S * 1e9) as i64;

/// Below this squared norm a magnetic field is none, whatever its unit.
const NO_FIELD: f64 = 1e-60;

/// The orientation with what is known about it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct AttitudeState {
    magnetometer: bool,
    previous_ns: Option<i64>,
    world_from_body: Option<UnitQuaternion<f64>>,
    heading_known: bool,
}

/// What there is to do for one sample once it has been accepted.
pub(super) struct Step {
    /// Time since the previous sample, in `0..=MAX_GAP_S`, seconds.
    pub(super) dt_s: f64,
    /// The orientation at the previous sample.
    pub(super) world_from_body: UnitQuaternion<f64>,
    /// Direction of the specific force in the body frame; `None` in free fall.
    pub(super) up: Option<Vector3<f64>>,
    /// Direction of the magnetic field in the body frame, if there is one to use.
    pub(super) field: Option<Vector3<f64>>,
}

impl AttitudeState {
    /// A state that has seen no sample.
    pub(super) fn new(magnetometer: bool) -> Self {
        Self { magnetometer, previous_ns: None, world_from_body: None, heading_known: false }
    }

    /// Checks a sample. `None` if the state has started or restarted with it and there is nothing to step.
    #[inline]
    pub(super) fn admit(&mut self, sample: &ImuSample) -> Result<Option<Step>, SampleError> {
        let squared = sample.check(self.magnetometer)?;
        let time_ns = sample.time_ns;
        if let Some(previous_ns) = self.previous_ns
            && time_ns <= previous_ns
        {
            return Err(SampleError::TimeNotIncreasing { previous_ns, time_ns });
        }

        let previous_ns = self.previous_ns.replace(time_ns);
        let up = direction(&sample.specific_force, squared.specific_force, FREE_FALL * FREE_FALL);
        let field = match (&sample.magnetic_field, squared.magnetic_field) {
            (Some(field), Some(squared)) => direction(field, squared, NO_FIELD),
            _ => None,
        };

        if let (Some(previous_ns), Some(world_from_body)) = (previous_ns, self.world_from_body) {
            // The difference of two stamps can be wider than their type.
            let dt_ns = time_ns.checked_sub(previous_ns).unwrap_or(i64::MAX);
            if dt_ns <= MAX_GAP_NS {
                let dt_s = dt_ns as f64 * 1e-9;
                return Ok(Some(Step { dt_s, world_from_body, up, field }));
            }
        }
        self.restart(up, field);
        Ok(None)
    }

    /// Keeps the orientation that a step ended with, of any norm but 0. The first field sets its heading.
    #[inline]
    pub(super) fn store(&mut self, world_from_body: &Quaternion<f64>, field: Option<Vector3<f64>>) {
        self.world_from_body = Some(normalised(world_from_body));
        if !self.heading_known
            && let Some(field) = field
        {
            self.face_north(&field);
        }
    }

    #[cold]
    fn face_north(&mut self, field: &Vector3<f64>) {
        if let Some(world_from_body) = self.world_from_body
            && let Some(error) = heading_error(&(world_from_body * field))
        {
            self.world_from_body = Some(normalised(&turn_heading(&world_from_body, error)));
            self.heading_known = true;
        }
    }

    /// Starts from a known orientation.
    pub(super) fn start_at(
        &mut self,
        time_ns: i64,
        world_from_body: UnitQuaternion<f64>,
    ) -> Result<(), SampleError> {
        let norm = world_from_body.norm();
        if !(0.5..2.0).contains(&norm) {
            return Err(SampleError::NonFinite { quantity: Quantity::Orientation });
        }
        self.previous_ns = Some(time_ns);
        self.world_from_body = Some(Unit::new_normalize(world_from_body.into_inner()));
        self.heading_known = true;
        Ok(())
    }

    /// The orientation, once there is one.
    pub(super) fn world_from_body(&self) -> Option<UnitQuaternion<f64>> {
        self.world_from_body
    }

    /// Whether a field has set the heading, or it was given.
    pub(super) fn heading_is_known(&self) -> bool {
        self.heading_known
    }

    /// Forgets every sample.
    pub(super) fn reset(&mut self) {
        *self = Self::new(self.magnetometer);
    }

    /// Levels what orientation there is, or none, and lets the next field set the heading.
    #[cold]
    fn restart(&mut self, up: Option<Vector3<f64>>, field: Option<Vector3<f64>>) {
        self.heading_known = false;
        let stale = self.world_from_body;
        let fresh = up.map(|up| {
            let stale = stale.unwrap_or_default();
            turn_upright(&stale, &(stale * up))
        });
        if let Some(world_from_body) = fresh.or(stale) {
            self.store(&world_from_body, field);
        }
    }
}

/// The unit vector along `vector`, or `None` if its squared norm is at most `least`.
#[inline]
fn direction(vector: &Vector3<f64>, squared: f64, least: f64) -> Option<Vector3<f64>> {
    (squared > least).then(|| vector * (1.0 / squared.sqrt()))
}
