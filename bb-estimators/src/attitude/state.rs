//! The common state of every filter, and how it starts, steps and restarts.

use nalgebra::{Quaternion, Unit, UnitQuaternion, Vector3};

use super::initial::heading_error;
use super::rotation::{normalised, turn_heading, turn_upright};
use super::sample::{Directions, usual_field};
use super::{ImuSample, Quantity, Real, SampleError};

/// The longest time between two samples that a filter integrates over, seconds.
///
/// Within a second, a hand turns a sensor by more than half a turn, which no single angular velocity describes. After
/// a longer gap, the tilt restarts from the accelerometer.
pub const MAX_GAP_S: f64 = 1.0;

const MAX_GAP_NS: i64 = (MAX_GAP_S * 1e9) as i64;

/// The orientation with what is known about it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct AttitudeState<T: Real> {
    magnetometer: bool,
    previous_ns: Option<i64>,
    world_from_body: Option<UnitQuaternion<T>>,
    heading_known: bool,
}

/// An ordinary sample: it shows which way is up, and comes soon after the one before.
pub(super) struct Usual<T> {
    /// Time since the previous sample, s.
    pub(super) dt_s: T,
    /// The orientation at the previous sample.
    pub(super) world_from_body: UnitQuaternion<T>,
    /// Direction of the magnetic field in the body frame, if there is one to use; the heading is then known.
    pub(super) field: Option<Vector3<T>>,
}

/// The remaining work for an accepted sample.
pub(super) struct Step<T> {
    /// Time since the previous sample, in `0..=MAX_GAP_S`, seconds.
    pub(super) dt_s: T,
    /// The orientation at the previous sample.
    pub(super) world_from_body: UnitQuaternion<T>,
    /// Direction of the specific force in the body frame; `None` in free fall.
    pub(super) up: Option<Vector3<T>>,
    /// Direction of the magnetic field in the body frame, if there is one to use.
    pub(super) field: Option<Vector3<T>>,
}

impl<T: Real> AttitudeState<T> {
    /// A state that has seen no sample.
    pub(super) fn new(magnetometer: bool) -> Self {
        Self { magnetometer, previous_ns: None, world_from_body: None, heading_known: false }
    }

    /// An ordinary sample: nearly every one. `None` for all others, which are left to [`admit`](Self::admit).
    #[inline(always)]
    pub(super) fn admit_usual(&mut self, sample: &ImuSample<T>) -> Option<Usual<T>> {
        let world_from_body = self.world_from_body?;
        let field = match &sample.magnetic_field {
            // The first field sets the heading.
            Some(field) if self.magnetometer => Some(usual_field(field).filter(|_| self.heading_known)?),
            _ => None,
        };
        let previous_ns = self.previous_ns.as_mut()?;
        if sample.time_ns <= *previous_ns {
            return None;
        }
        // As unsigned, the difference of any two stamps in order is exact.
        let dt_ns = sample.time_ns.wrapping_sub(*previous_ns);
        if dt_ns.cast_unsigned() > MAX_GAP_NS.cast_unsigned() || !sample.is_usual() {
            return None;
        }
        *previous_ns = sample.time_ns;
        Some(Usual { dt_s: T::seconds(dt_ns), world_from_body, field })
    }

    /// Checks a sample. `None` if the state has started or restarted with it, so there is no step.
    #[inline]
    pub(super) fn admit(&mut self, sample: &ImuSample<T>) -> Result<Option<Step<T>>, SampleError> {
        let Directions { up, field } = sample.directions(self.magnetometer)?;
        let time_ns = sample.time_ns;
        if let Some(previous_ns) = self.previous_ns
            && time_ns <= previous_ns
        {
            return Err(SampleError::TimeNotIncreasing { previous_ns, time_ns });
        }

        let previous_ns = self.previous_ns.replace(time_ns);
        if let (Some(previous_ns), Some(world_from_body)) = (previous_ns, self.world_from_body) {
            // The difference of two stamps can overflow their type.
            let dt_ns = time_ns.checked_sub(previous_ns).unwrap_or(i64::MAX);
            if dt_ns <= MAX_GAP_NS {
                return Ok(Some(Step { dt_s: T::seconds(dt_ns), world_from_body, up, field }));
            }
        }
        self.restart(sample);
        Ok(None)
    }

    /// Keeps the orientation after a step, of any norm but 0. The first field sets its heading.
    #[inline]
    pub(super) fn store(&mut self, world_from_body: &Quaternion<T>, field: Option<Vector3<T>>) {
        self.keep(normalised(world_from_body), field);
    }

    /// Keeps the orientation after a step. The first field sets its heading.
    #[inline]
    pub(super) fn keep(&mut self, world_from_body: UnitQuaternion<T>, field: Option<Vector3<T>>) {
        self.world_from_body = Some(world_from_body);
        if !self.heading_known
            && let Some(field) = field
        {
            self.face_north(&field);
        }
    }

    #[cold]
    fn face_north(&mut self, field: &Vector3<T>) {
        if let Some(world_from_body) = self.world_from_body
            && let Some(error) = heading_error(&(world_from_body * field))
        {
            self.world_from_body = Some(normalised(&turn_heading(&world_from_body, error)));
            self.heading_known = true;
        }
    }

    /// Starts from a known orientation.
    pub(super) fn start_at(&mut self, time_ns: i64, world_from_body: UnitQuaternion<T>) -> Result<(), SampleError> {
        let norm = world_from_body.norm();
        if !(T::HALF..T::TWO).contains(&norm) {
            return Err(SampleError::NonFinite { quantity: Quantity::Orientation });
        }
        self.previous_ns = Some(time_ns);
        self.world_from_body = Some(Unit::new_normalize(world_from_body.into_inner()));
        self.heading_known = true;
        Ok(())
    }

    /// The orientation, once there is one.
    pub(super) fn world_from_body(&self) -> Option<UnitQuaternion<T>> {
        self.world_from_body
    }

    /// Returns whether a field has set the heading, or it was given.
    pub(super) fn heading_is_known(&self) -> bool {
        self.heading_known
    }

    /// Forgets every sample.
    pub(super) fn reset(&mut self) {
        *self = Self::new(self.magnetometer);
    }

    /// Levels the orientation, if there is one, and lets the next field set the heading.
    #[cold]
    fn restart(&mut self, sample: &ImuSample<T>) {
        // Computed again, so that a step need not keep them for this; they have been checked.
        let Ok(Directions { up, field }) = sample.directions(self.magnetometer) else { return };
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
