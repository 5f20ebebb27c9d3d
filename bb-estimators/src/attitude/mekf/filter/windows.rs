//! The end of a window: propagates and corrects the errors, and prepares the window's measurements.

use nalgebra::{UnitQuaternion, Vector3};

use super::MekfFilter;
use crate::attitude::Real;
use crate::attitude::mekf::errors::ProcessNoise;
use crate::attitude::mekf::iron::FieldMeans;
use crate::attitude::mekf::measurement::Measurements;
use crate::attitude::mekf::rest::{BodyMeans, KnownBias, Missed};
use crate::attitude::mekf::states::{BIAS, CALIBRATION, ROTATION};
use crate::attitude::mekf::vertical::Contradiction;
use crate::attitude::mekf::window::Window;
use crate::attitude::rotation::turn;

/// How long a velocity lasts, s: the pseudo-measurement of zero has errors correlated over twice this time.
const VELOCITY_TIME_S: f64 = 0.5;

/// Time constant of the mean square acceleration, s.
const ACCELERATION_TIME_CONSTANT_S: f64 = 2.0;

/// Velocity at rest, in a mean over a second, m/s: the table trembles.
const REST_VELOCITY: f64 = 0.05;

/// Noise of the accelerometer, of its scale and of the lever arm's rotation, m/s/√s.
const ACCELEROMETER_NOISE: f64 = 0.02;

/// How much the gyroscope's mean over a second at rest may differ from its bias, rad/s: 0.07°/s.
const REST_BIAS: f64 = 1.2e-3;

/// A bias at rest this many standard deviations off has stepped.
const BIAS_STEP: f64 = 4.0;

/// The largest difference from the bias for which rest is accepted, rad/s: 2°/s, VQF's `biasClip`.
const MAX_REST_BIAS: f64 = 0.035;

impl<T: Real> MekfFilter<T> {
    /// Ends a window: propagates the errors to now, corrects by them, and evaluates the window.
    pub(super) fn close_window(&mut self, orientation: UnitQuaternion<T>) -> UnitQuaternion<T> {
        while self.measurements.take(&mut self.errors) {}
        let window = core::mem::replace(&mut self.window, Window::new());
        let (params, dt) = (&self.params, window.duration);
        let rotation_noise = T::of(params.gyroscope_noise * params.gyroscope_noise) * dt
            + T::of(params.gyroscope_rate_noise * params.gyroscope_rate_noise) * window.squared_rate;
        self.errors.propagate(
            &window,
            &ProcessNoise {
                rotation: rotation_noise,
                bias: T::of(params.bias_drift * params.bias_drift) * dt,
                velocity: T::of(ACCELEROMETER_NOISE * ACCELEROMETER_NOISE) * dt,
            },
        );
        if !self.errors.are_sane() {
            return self.recover(orientation);
        }

        let correction = self.correct();
        let orientation = correction * orientation;
        self.rotation = *orientation.to_rotation_matrix().matrix();
        let force = correction * window.force;
        match self.vertical.add(dt, &correction, &force) {
            Some(Contradiction::Start(up, deviation)) => return self.level_start(orientation, &up, deviation),
            Some(Contradiction::Tilt(up)) => return self.level(orientation, &up),
            None => {}
        }
        self.iron.correct(&correction);
        let fields = window.mean_field(&correction);
        let drift = self.drift_variance();
        self.observe_rest(dt, fields.as_ref(), &force, drift);
        self.adoption = fields
            .as_ref()
            .and_then(|fields| self.iron.observe(dt, fields, self.rest.is_detected(), self.field.as_ref(), drift));
        self.measure(dt, fields.as_ref(), &force);
        orientation
    }

    /// Moves the mean errors into the estimates; returns the rotation.
    pub(super) fn correct(&mut self) -> UnitQuaternion<T> {
        let mean = &mut self.errors.mean;
        let rotation = Vector3::new(mean[ROTATION], mean[ROTATION + 1], mean[ROTATION + 2]);
        for i in 0..3 {
            self.bias[i] += mean[BIAS + i];
            for k in 0..3 {
                self.calibration[(i, k)] += mean[CALIBRATION + 3 * i + k];
            }
        }
        mean[..CALIBRATION + 9].fill(T::ZERO);
        turn(&UnitQuaternion::identity(), &rotation)
    }

    /// Prepares a window's measurements, to be fused with the samples of the next one.
    fn measure(&mut self, dt: T, fields: Option<&FieldMeans<T>>, force: &Vector3<T>) {
        let resting = self.rest.is_detected();
        let squared = (force.x * force.x + force.y * force.y) / (dt * dt);
        let gain = (dt / T::of(ACCELERATION_TIME_CONSTANT_S)).min(T::ONE);
        self.squared_acceleration += (squared - self.squared_acceleration) * gain;
        let velocity_variance = if resting {
            T::of(REST_VELOCITY * REST_VELOCITY) / dt
        } else {
            let growth = T::of(self.params.acceleration_time * self.params.acceleration_time);
            let squared = T::of(self.params.velocity * self.params.velocity) + growth * self.squared_acceleration;
            squared * T::TWO * T::of(VELOCITY_TIME_S) / dt
        };
        let bias = if resting { self.rest_bias(dt) } else { None };
        let heading = fields.map(|fields| self.heading(dt, fields));
        self.measurements = Measurements::new(velocity_variance, heading, bias);
    }

    /// Variance of the gyroscope's bias about the vertical, (rad/s)².
    fn drift_variance(&self) -> T {
        let up = self.rotation.row(2).transpose();
        up.dot(&(self.errors.block(BIAS) * up)).max(T::ZERO)
    }

    /// Adds a window to what distinguishes rest from a slow rotation.
    fn observe_rest(&mut self, dt: T, fields: Option<&FieldMeans<T>>, force: &Vector3<T>, drift: T) {
        let means = BodyMeans {
            force: self.rotation.tr_mul(force) / dt,
            field: fields.map(|fields| self.rotation.tr_mul(&fields.field)),
            offset: self.iron.offset,
        };
        let bias = KnownBias {
            mean: self.bias,
            deviation: self.errors.block(BIAS).diagonal().max().max(T::ZERO).sqrt(),
            vertical_deviation: drift.sqrt(),
        };
        if let Some(Missed { bias, squared_angle }) = self.rest.observe(dt, &means, bias) {
            self.bias = bias.mean;
            self.errors.forget::<3>(BIAS, bias.deviation * bias.deviation);
            self.errors.doubt(ROTATION + 2, squared_angle);
            self.iron.forget_rotations();
        }
    }

    /// The gyroscope's reading at rest is its bias.
    fn rest_bias(&mut self, dt: T) -> Option<(Vector3<T>, T)> {
        let difference = self.rest.rate - self.bias;
        let squared = difference.norm_squared();
        let expected = self.errors.variance(BIAS) + T::of(REST_BIAS * REST_BIAS);
        if squared > T::of(BIAS_STEP * BIAS_STEP) * expected {
            // A slow rotation is as probable until it is excluded.
            if !self.rest.is_certain() {
                return None;
            }
            for axis in 0..3 {
                self.errors.doubt(BIAS + axis, squared);
            }
        }
        let most = (T::of(MAX_REST_BIAS * MAX_REST_BIAS) / squared.max(T::of(1e-12))).min(T::ONE).sqrt();
        Some((difference * most, T::of(REST_BIAS * REST_BIAS) / dt))
    }
}
