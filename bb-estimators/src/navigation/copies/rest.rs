//! Rest that the accelerometer shows: the body vibrates as it did at rest, and clearly less than in motion.
//!
//! How much a body vibrates depends on the vehicle and its road, and an engine may idle. So the vibration is remembered of the last seconds
//! in which the filter knew that the body moved, and of those in which it knew that it did not. A body that vibrates like these for three
//! seconds, and not like those, is at rest, unless the filter's velocity or the gyroscope contradicts. A vehicle that was seen to move as
//! quietly as it rests, on rails or in the air, is not taken to be at rest.

use nalgebra::{Matrix3, Vector3};

use crate::moments::Moments;
use crate::navigation::eskf::ImuMean;
use crate::navigation::math::sqrt;
use crate::navigation::measurement::{Linearised, Measurement, isotropic};
use crate::navigation::numbers::{
    LEAST_RATE_VARIANCE, LOUDER, QUIETER, REST_PLACE, REST_WINDOW_S, REST_WINDOWS, SUCCESSIVE,
};
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, GYROSCOPE_BIAS, States};

/// The window that is gathered, and those before.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rest {
    seconds: f64,
    count: f64,
    last: Option<Vector3<f64>>,
    /// Sum of the squared changes of the specific force from sample to sample.
    changes: Vector3<f64>,
    rate: Moments,
    /// The variances of the vibration, (m/s²)², the newest first.
    moving: [f64; REST_WINDOWS],
    resting: [f64; REST_WINDOWS],
    quiet: u32,
}

impl Default for Rest {
    fn default() -> Self {
        Self {
            seconds: 0.0,
            count: 0.0,
            last: None,
            changes: Vector3::zeros(),
            rate: Moments::default(),
            // Nothing is quieter than that.
            moving: [0.0; REST_WINDOWS],
            resting: [0.0; REST_WINDOWS],
            quiet: 0,
        }
    }
}

/// A window that has ended.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    /// The variance of the vibration, (m/s²)².
    variance: f64,
    pub(super) bias: GyroscopeAtRest,
}

impl Rest {
    /// Adds a sample. Returns the window that it ends.
    #[inline]
    pub(super) fn add(&mut self, sample: &ImuMean, dt: f64) -> Option<Window> {
        self.seconds += dt;
        self.count += 1.0;
        if let Some(last) = self.last.replace(sample.specific_force) {
            let change = sample.specific_force - last;
            self.changes += change.component_mul(&change);
        }
        self.rate.add(self.count, &sample.angular_velocity);
        (self.seconds >= REST_WINDOW_S).then(|| self.end())
    }

    fn end(&mut self) -> Window {
        let variance = self.rate.largest_variance(self.count) / self.count;
        let bias = GyroscopeAtRest { reading: self.rate.mean, deviation: sqrt(variance.max(LEAST_RATE_VARIANCE)) };
        // The changes of white noise have twice its variance.
        let window = Window { variance: self.changes.max() / (2.0 * self.count), bias };
        *self = Self { last: self.last, quiet: self.quiet, ..self.remembered() };
        window
    }

    /// Forgets the window.
    pub(super) fn interrupt(&mut self) {
        *self = self.remembered();
    }

    fn remembered(&self) -> Self {
        Self { moving: self.moving, resting: self.resting, ..Self::default() }
    }

    /// Remembers a window in which it is known whether the body moved: not by the window itself, so that rest does not become louder and
    /// louder.
    pub(super) fn remember(&mut self, window: &Window, has_moved: bool) {
        if !has_moved && self.quiet >= SUCCESSIVE {
            return;
        }
        let windows = if has_moved { &mut self.moving } else { &mut self.resting };
        windows.rotate_right(1);
        windows[0] = window.variance;
    }

    /// Returns whether a window, and those before, look like rest.
    pub(super) fn is_rest(&mut self, window: &Window) -> bool {
        let mut moving = self.moving;
        moving.sort_by(f64::total_cmp);
        let loudest = self.resting.iter().copied().fold(0.0, f64::max);
        let is_quiet = window.variance <= LOUDER * loudest && window.variance * QUIETER < moving[REST_PLACE];
        self.quiet = if is_quiet { self.quiet.saturating_add(1) } else { 0 };
        self.quiet >= SUCCESSIVE
    }
}

/// The mean reading of a gyroscope at rest: its bias.
#[derive(Clone, Copy, Debug)]
pub(super) struct GyroscopeAtRest {
    reading: Vector3<f64>,
    deviation: f64,
}

impl Measurement<3> for GyroscopeAtRest {
    fn linearise<S: States, const N: usize>(
        &self,
        at: &Estimate<N>,
        model: &mut Linearised<3, N>,
    ) -> Result<(), Refusal> {
        model.set_residual(0, &(self.reading - at.gyroscope_bias));
        model.set_noise(0, &isotropic(self.deviation));
        model.set_block(0, GYROSCOPE_BIAS, &Matrix3::identity());
        Ok(())
    }
}
