//! One step of the revised AHRS algorithm.

use nalgebra::{UnitQuaternion, Vector3};

use super::FusionParams;
use super::offset::Offset;
use super::rejection::Rejection;
use crate::attitude::directions::{expected, horizontal_axis};
use crate::attitude::initial::MIN_HORIZONTAL_FRACTION;
use crate::attitude::rotation::turn;
use crate::attitude::state::AttitudeState;
use crate::attitude::{AttitudeFilter, ImuSample, MAX_GAP_S, ParamsError, Real, SampleError};
use crate::params::Params as _;

/// The gain at startup, 1/s, and the time over which it decreases to its value, s. Source: the library's.
const STARTUP_GAIN: f64 = 10.0;
const STARTUP_S: f64 = 3.0;

/// An angular velocity beyond this fraction of the gyroscope's range may be beyond the range. Source: the library's.
const FULL_RANGE: f64 = 0.98;

/// Beyond a right angle the correction is that of twice the greatest sine. Source: the library's.
const FAR: f64 = 2.0;

/// Norm below which an error has no direction.
const NO_ERROR: f64 = 1e-12;

/// The revised AHRS algorithm of Madgwick's thesis.
#[derive(Clone, Debug, PartialEq)]
pub struct FusionFilter<T: Real = f64> {
    params: FusionParams,
    state: AttitudeState<T>,
    offset: Offset<T>,
    /// The remaining startup time, s.
    startup_s: T,
    acceleration: Rejection<T>,
    field: Rejection<T>,
    /// Squared sines of the greatest deviations that are not rejected.
    near_acceleration: T,
    near_field: T,
    /// Time since the last field, at most [`MAX_GAP_S`].
    since_field_s: T,
}

/// The deviation of a measured direction from the expected one.
struct Deviation<T> {
    /// Sine of the angle, times the axis to turn the body about; of length [`FAR`] beyond a right angle.
    error: Vector3<T>,
    /// Squared sine; infinite beyond a right angle.
    squared_sine: T,
}

impl<T: Real> AttitudeFilter<T> for FusionFilter<T> {
    type Params = FusionParams;

    fn new(params: FusionParams) -> Result<Self, ParamsError> {
        params.check()?;
        Ok(Self {
            params,
            state: AttitudeState::new(params.magnetometer),
            offset: Offset::new(),
            startup_s: T::ZERO,
            acceleration: Rejection::new(),
            field: Rejection::new(),
            near_acceleration: squared_sine(T::of(params.acceleration_rejection)),
            near_field: squared_sine(T::of(params.magnetic_rejection)),
            since_field_s: T::ZERO,
        })
    }

    fn params(&self) -> &FusionParams {
        &self.params
    }

    fn update(&mut self, sample: &ImuSample<T>) -> Result<(), SampleError> {
        let Some(step) = self.state.admit(sample)? else {
            self.begin(T::of(STARTUP_S));
            return Ok(());
        };
        let range = T::of(self.params.gyroscope_range);
        if range > T::ZERO && sample.angular_velocity.amax() > T::of(FULL_RANGE) * range {
            self.begin(T::of(STARTUP_S));
        }
        self.startup_s = (self.startup_s - step.dt_s).max(T::ZERO);
        let gain = self.gain();
        let rate = self.rate(step.dt_s, &sample.angular_velocity);
        let orientation = turn(&step.world_from_body, &(rate * step.dt_s));

        let [world_east, world_up] = expected(&orientation);
        let mut correction = Vector3::zeros();
        if let Some(up) = &step.up {
            let deviation = deviation(up, &world_up, || horizontal_axis(world_up));
            if self.takes_acceleration(step.dt_s, &deviation) {
                correction += deviation.error * (gain * step.dt_s).min(T::ONE);
            }
        }
        self.since_field_s = (self.since_field_s + step.dt_s).min(T::of(MAX_GAP_S));
        if let Some(field) = &step.field {
            let west = world_up.cross(field);
            let squared = west.norm_squared();
            if squared > T::of(MIN_HORIZONTAL_FRACTION * MIN_HORIZONTAL_FRACTION) {
                let west = west * (T::ONE / squared.sqrt());
                let deviation = deviation(&west, &-world_east, || world_up);
                let dt_s = core::mem::take(&mut self.since_field_s);
                if self.takes_field(dt_s, &deviation) {
                    correction += deviation.error * (gain * dt_s).min(T::ONE);
                }
            }
        }
        self.state.store(&turn(&orientation, &correction), step.field);
        Ok(())
    }

    fn start_at(&mut self, time_ns: i64, world_from_body: UnitQuaternion<T>) -> Result<(), SampleError> {
        self.state.start_at(time_ns, world_from_body)?;
        self.begin(T::ZERO);
        Ok(())
    }

    fn world_from_body(&self) -> Option<UnitQuaternion<T>> {
        self.state.world_from_body()
    }

    fn gyroscope_bias(&self) -> Option<Vector3<T>> {
        self.params.offset_correction.then_some(self.offset.offset)
    }

    /// True while the gyroscope's offset is being estimated.
    fn is_at_rest(&self) -> Option<bool> {
        self.params.offset_correction.then(|| self.offset.is_still(T::of(self.params.rest_time)))
    }

    /// True if the last field was rejected.
    fn is_magnetically_disturbed(&self) -> Option<bool> {
        let watched = self.params.magnetometer && T::of(self.params.magnetic_rejection) > T::ZERO;
        watched.then_some(self.field.is_ignored())
    }

    fn reset(&mut self) {
        if let Ok(new) = Self::new(self.params) {
            *self = new;
        }
    }
}

impl<T: Real> FusionFilter<T> {
    #[cold]
    fn begin(&mut self, startup_s: T) {
        // Without feedback there is no startup.
        self.startup_s = if T::of(self.params.gain) > T::ZERO { startup_s } else { T::ZERO };
        self.acceleration = Rejection::new();
        self.field = Rejection::new();
        self.offset.forget_motion();
        self.since_field_s = T::ZERO;
    }

    /// The current gain, 1/s.
    pub(super) fn gain(&self) -> T {
        let gain = T::of(self.params.gain);
        if self.startup_s > T::ZERO {
            gain + (T::of(STARTUP_GAIN) - gain).max(T::ZERO) * (self.startup_s / T::of(STARTUP_S))
        } else {
            gain
        }
    }

    /// The angular velocity without the offset, rad/s.
    fn rate(&mut self, dt_s: T, measured: &Vector3<T>) -> Vector3<T> {
        if !self.params.offset_correction {
            return *measured;
        }
        self.offset.correct(dt_s, measured, T::of(self.params.rest_angular_velocity), T::of(self.params.rest_time))
    }

    fn takes_acceleration(&mut self, dt_s: T, deviation: &Deviation<T>) -> bool {
        let near = self.startup_s > T::ZERO || deviation.squared_sine <= self.near_acceleration;
        self.acceleration.takes(dt_s, T::of(self.params.recovery_time), near)
    }

    fn takes_field(&mut self, dt_s: T, deviation: &Deviation<T>) -> bool {
        let near = self.startup_s > T::ZERO || deviation.squared_sine <= self.near_field;
        self.field.takes(dt_s, T::of(self.params.recovery_time), near)
    }
}

/// Returns the squared sine of a threshold, rad; infinity for 0, which disables it.
fn squared_sine<T: Real>(threshold: T) -> T {
    let sine = threshold.sin();
    if threshold > T::ZERO { sine * sine } else { T::of(f64::INFINITY) }
}

/// The deviation of two unit vectors; `axis` is the axis of rotation if they are opposite.
#[inline]
fn deviation<T: Real>(
    measured: &Vector3<T>,
    expected: &Vector3<T>,
    axis: impl FnOnce() -> Vector3<T>,
) -> Deviation<T> {
    let error = measured.cross(expected);
    let squared_sine = error.norm_squared();
    if measured.dot(expected) >= T::ZERO {
        return Deviation { error, squared_sine };
    }
    let least = T::above_rounding(NO_ERROR);
    let axis = if squared_sine > least * least { error * (T::ONE / squared_sine.sqrt()) } else { axis() };
    Deviation { error: axis * T::of(FAR), squared_sine: T::of(f64::INFINITY) }
}
