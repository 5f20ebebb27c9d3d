//! How the filter starts and restarts: with a sample, after a gap, and if its estimates are contradicted.

use nalgebra::{UnitQuaternion, Vector3};

use super::{INITIAL_HEADING, MekfFilter};
use crate::attitude::initial::heading_error;
use crate::attitude::mekf::INITIAL_TILT;
use crate::attitude::mekf::measurement::Measurements;
use crate::attitude::mekf::rest::Rest;
use crate::attitude::mekf::states::{BIAS, CALIBRATION, FORCE_LATENCY, ROTATION, VELOCITY};
use crate::attitude::mekf::vertical::Vertical;
use crate::attitude::mekf::window::Window;
use crate::attitude::rotation::{turn_heading, turn_upright};
use crate::attitude::{AttitudeFilter, ImuSample, Real};

/// Standard deviation of the velocity at the start, m/s: a hand, a pedestrian.
const INITIAL_VELOCITY: f64 = 1.0;

impl<T: Real> MekfFilter<T> {
    /// After a start from a sample, the first one or the one after a gap.
    #[cold]
    pub(super) fn restart(&mut self, sample: &ImuSample<T>) {
        let Some(orientation) = self.state.world_from_body() else {
            return;
        };
        let direction = sample.magnetic_field.filter(|_| self.params.magnetometer).map(|field| field.normalize());
        self.heading_known = direction.is_some_and(|direction| heading_error(&(orientation * direction)).is_some());
        self.rest = Rest::new(&sample.angular_velocity, &sample.specific_force);
        self.last_field = sample.magnetic_field.unwrap_or_default();
        self.last_field_is_stale = false;
        self.begin(&orientation, T::of(INITIAL_TILT), T::of(INITIAL_HEADING));
        self.vertical = Vertical::new(true);
    }

    /// Resets the orientation's errors; the sensor errors are kept.
    pub(super) fn begin(&mut self, orientation: &UnitQuaternion<T>, tilt_deviation: T, heading_deviation: T) {
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
        self.adoption = None;
    }

    /// Resets the uncertainty of the sensor errors to that at the start.
    pub(super) fn forget_sensors(&mut self) {
        let params = &self.params;
        self.errors.forget::<3>(BIAS, T::of(params.initial_bias * params.initial_bias));
        self.errors.forget::<9>(CALIBRATION, T::of(params.calibration_error * params.calibration_error));
        let latency = T::of(params.accelerometer_latency);
        self.errors.forget::<1>(FORCE_LATENCY, latency * latency);
    }

    /// The body accelerated at the start: levels it by the mean specific force since, known up to `deviation`, rad.
    /// The heading is that of the mean field since; the sensor errors and the field's sums are kept.
    #[cold]
    pub(super) fn level_start(
        &mut self,
        orientation: UnitQuaternion<T>,
        up: &Vector3<T>,
        deviation: T,
    ) -> UnitQuaternion<T> {
        let mut turned = turn_upright(&orientation, up);
        let level = turned * orientation.inverse();
        let last = || self.params.magnetometer.then(|| orientation * self.last_field);
        if let Some(field) = self.iron.mean_field().or_else(last)
            && let Some(direction) = (level * field).try_normalize(T::ZERO)
            && let Some(error) = heading_error(&direction)
        {
            turned = turn_heading(&turned, error);
            self.field = None;
        }
        let (vertical, iron) = (self.vertical.clone(), self.iron.clone());
        self.begin(&turned, deviation, T::of(INITIAL_HEADING));
        self.iron = iron;
        self.iron.level(&(turned * orientation.inverse()));
        self.vertical = vertical;
        self.vertical.levelled();
        turned
    }

    /// The tilt contradicts the mean specific force: restarts it, and the heading with the next field.
    #[cold]
    pub(super) fn level(&mut self, orientation: UnitQuaternion<T>, up: &Vector3<T>) -> UnitQuaternion<T> {
        let orientation = turn_upright(&orientation, up);
        self.begin(&orientation, T::of(INITIAL_TILT), T::of(INITIAL_HEADING));
        self.forget_sensors();
        self.heading_known = !self.params.magnetometer;
        self.field = None;
        orientation
    }

    /// Absurd numbers came in and no estimate is usable: restarts from the orientation.
    #[cold]
    pub(super) fn recover(&mut self, orientation: UnitQuaternion<T>) -> UnitQuaternion<T> {
        let (state, heading_known) = (self.state.clone(), self.heading_known);
        self.reset();
        (self.state, self.heading_known) = (state, heading_known);
        self.begin(&orientation, T::of(INITIAL_TILT), T::of(INITIAL_HEADING));
        orientation
    }
}
