//! One step of the revised AHRS algorithm.

use nalgebra::{UnitQuaternion, Vector3};

use super::FusionParams;
use super::offset::Offset;
use super::rejection::Rejection;
use crate::attitude::directions::{expected, horizontal_axis};
use crate::attitude::initial::MIN_HORIZONTAL_FRACTION;
use crate::attitude::rotation::turn;
use crate::attitude::state::AttitudeState;
use crate::attitude::{AttitudeFilter, ImuSample, MAX_GAP_S, ParamsError, SampleError};

/// The gain at startup, 1/s, and how long it takes to go down to its value, s. Source: the library's.
const STARTUP_GAIN: f64 = 10.0;
const STARTUP_S: f64 = 3.0;

/// An angular velocity beyond this fraction of the gyroscope's range may be beyond the range. Source: the library's.
const FULL_RANGE: f64 = 0.98;

/// Beyond a right angle the correction is that of twice the greatest sine. Source: the library's.
const FAR: f64 = 2.0;

/// Below this squared norm an error has no direction.
const NO_ERROR: f64 = 1e-24;

/// The revised AHRS algorithm of Madgwick's thesis.
#[derive(Clone, Debug, PartialEq)]
pub struct FusionFilter {
    params: FusionParams,
    state: AttitudeState,
    offset: Offset,
    /// What is left of startup, s.
    startup_s: f64,
    acceleration: Rejection,
    field: Rejection,
    /// Squared sines of the greatest deviations that are not rejected.
    near_acceleration: f64,
    near_field: f64,
    /// Time since the last field, at most [`MAX_GAP_S`].
    since_field_s: f64,
}

/// How far a measured direction is from the expected one.
struct Deviation {
    /// Sine of the angle, times the axis to turn the body about; of length [`FAR`] beyond a right angle.
    error: Vector3<f64>,
    /// Squared sine; infinite beyond a right angle.
    squared_sine: f64,
}

impl AttitudeFilter for FusionFilter {
    type Params = FusionParams;

    fn new(params: FusionParams) -> Result<Self, ParamsError> {
        params.check()?;
        Ok(Self {
            params,
            state: AttitudeState::new(params.magnetometer),
            offset: Offset::new(),
            startup_s: 0.0,
            acceleration: Rejection::new(),
            field: Rejection::new(),
            near_acceleration: squared_sine(params.acceleration_rejection),
            near_field: squared_sine(params.magnetic_rejection),
            since_field_s: 0.0,
        })
    }

    fn params(&self) -> &FusionParams {
        &self.params
    }

    fn update(&mut self, sample: &ImuSample) -> Result<(), SampleError> {
        let Some(step) = self.state.admit(sample)? else {
            self.begin(STARTUP_S);
            return Ok(());
        };
        let range = self.params.gyroscope_range;
        if range > 0.0 && sample.angular_velocity.amax() > FULL_RANGE * range {
            self.begin(STARTUP_S);
        }
        self.startup_s = (self.startup_s - step.dt_s).max(0.0);
        let gain = self.gain();
        let rate = self.rate(step.dt_s, &sample.angular_velocity);
        let orientation = turn(&step.world_from_body, &(rate * step.dt_s));

        let [world_east, world_up] = expected(&orientation);
        let mut correction = Vector3::zeros();
        if let Some(up) = &step.up {
            let deviation = deviation(up, &world_up, || horizontal_axis(&world_up));
            if self.takes_acceleration(step.dt_s, &deviation) {
                correction += deviation.error * (gain * step.dt_s).min(1.0);
            }
        }
        self.since_field_s = (self.since_field_s + step.dt_s).min(MAX_GAP_S);
        if let Some(field) = &step.field {
            let west = world_up.cross(field);
            let squared = west.norm_squared();
            if squared > MIN_HORIZONTAL_FRACTION * MIN_HORIZONTAL_FRACTION {
                let west = west * (1.0 / squared.sqrt());
                let deviation = deviation(&west, &-world_east, || world_up);
                let dt_s = core::mem::take(&mut self.since_field_s);
                if self.takes_field(dt_s, &deviation) {
                    correction += deviation.error * (gain * dt_s).min(1.0);
                }
            }
        }
        self.state.store(&turn(&orientation, &correction), step.field);
        Ok(())
    }

    fn start_at(&mut self, time_ns: i64, world_from_body: UnitQuaternion<f64>) -> Result<(), SampleError> {
        self.state.start_at(time_ns, world_from_body)?;
        self.begin(0.0);
        Ok(())
    }

    fn world_from_body(&self) -> Option<UnitQuaternion<f64>> {
        self.state.world_from_body()
    }

    fn gyroscope_bias(&self) -> Option<Vector3<f64>> {
        self.params.offset_correction.then_some(self.offset.offset)
    }

    /// When the gyroscope's offset is being found.
    fn is_at_rest(&self) -> Option<bool> {
        self.params.offset_correction.then(|| self.offset.is_still(self.params.rest_time))
    }

    /// When the last field was rejected.
    fn is_magnetically_disturbed(&self) -> Option<bool> {
        let watched = self.params.magnetometer && self.params.magnetic_rejection > 0.0;
        watched.then_some(self.field.is_ignored())
    }

    fn reset(&mut self) {
        if let Ok(new) = Self::new(self.params) {
            *self = new;
        }
    }
}

impl FusionFilter {
    #[cold]
    fn begin(&mut self, startup_s: f64) {
        // Without feedback there is nothing to start up.
        self.startup_s = if self.params.gain > 0.0 { startup_s } else { 0.0 };
        self.acceleration = Rejection::new();
        self.field = Rejection::new();
        self.offset.forget_motion();
        self.since_field_s = 0.0;
    }

    /// The gain of now, 1/s.
    pub(super) fn gain(&self) -> f64 {
        let gain = self.params.gain;
        if self.startup_s > 0.0 {
            gain + (STARTUP_GAIN - gain).max(0.0) * (self.startup_s / STARTUP_S)
        } else {
            gain
        }
    }

    /// The angular velocity without the offset, rad/s.
    fn rate(&mut self, dt_s: f64, measured: &Vector3<f64>) -> Vector3<f64> {
        if !self.params.offset_correction {
            return *measured;
        }
        self.offset.correct(dt_s, measured, self.params.rest_angular_velocity, self.params.rest_time)
    }

    fn takes_acceleration(&mut self, dt_s: f64, deviation: &Deviation) -> bool {
        let near = self.startup_s > 0.0 || deviation.squared_sine <= self.near_acceleration;
        self.acceleration.takes(dt_s, self.params.recovery_time, near)
    }

    fn takes_field(&mut self, dt_s: f64, deviation: &Deviation) -> bool {
        let near = self.startup_s > 0.0 || deviation.squared_sine <= self.near_field;
        self.field.takes(dt_s, self.params.recovery_time, near)
    }
}

/// Of a threshold, rad, of which 0 is none.
fn squared_sine(threshold: f64) -> f64 {
    let sine = threshold.sin();
    if threshold > 0.0 { sine * sine } else { f64::INFINITY }
}

/// The deviation of two unit vectors; `axis` is what to turn about where they are opposite.
#[inline]
fn deviation(measured: &Vector3<f64>, expected: &Vector3<f64>, axis: impl FnOnce() -> Vector3<f64>) -> Deviation {
    let error = measured.cross(expected);
    let squared_sine = error.norm_squared();
    if measured.dot(expected) >= 0.0 {
        return Deviation { error, squared_sine };
    }
    let axis = if squared_sine > NO_ERROR { error * (1.0 / squared_sine.sqrt()) } else { axis() };
    Deviation { error: axis * FAR, squared_sine: f64::INFINITY }
}
