//! Finds rests of a sensor, and its measurements there.

use nalgebra::ComplexField;
use nalgebra::Vector3;

use crate::attitude::{ImuSample, ParamsError};
use crate::moments::Moments;
use crate::params::{Params as _, params};

params! {
    /// Criteria of rest.
    pub struct RestParams {
        /// Time for which samples are collected before they are judged: the pieces that a rest is put together from.
        ///
        /// Small: short rests count, and slow motion passes for rest. Large: the ends of rests are lost.
        ///
        /// Source: a quarter of a rest of two seconds.
        window: f64 = 0.5, in 0.01..=100.0, unit "s";
        /// Least duration of a rest, without its first and its last window, in which a hand lets go and takes hold.
        ///
        /// Small: pauses count. Large: the mean of a rest has less noise.
        ///
        /// Source: a second of a MEMS accelerometer averages its noise to 0.2 mg.
        time: f64 = 1.0, in 0.01..=1e4, unit "s";
        /// The most that the angular velocity varies at rest, standard deviation of a component.
        ///
        /// Small: noise is mistaken for motion. Large: motion is mistaken for rest.
        ///
        /// Source: MEMS gyroscopes at 100 to 1000 Hz have 0.002 to 0.01 rad/s.
        rotation: f64 = 0.02, in 1e-6..=100.0, unit "rad/s";
        /// The most that the specific force varies at rest, standard deviation of a component.
        ///
        /// Small: noise is mistaken for motion. Large: motion is mistaken for rest.
        ///
        /// Source: MEMS accelerometers at 100 to 1000 Hz have 0.02 to 0.1 m/s².
        force: f64 = 0.15, in 1e-6..=1e4, unit "m/s^2";
    }
}

/// A rest: means over its time, body frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rest {
    /// Time at which it begins, nanoseconds.
    pub start_ns: i64,
    /// Time at which it ends, nanoseconds.
    pub end_ns: i64,
    /// The number of its samples.
    pub samples: u64,
    /// Specific force, in the sensor's unit.
    pub force: Vector3<f64>,
    /// Angular velocity, in the sensor's unit.
    pub rate: Vector3<f64>,
    /// Standard deviation of a component of one sample's specific force, in the mean over the components.
    pub force_deviation: f64,
    /// Standard deviation of a component of one sample's angular velocity, in the mean over the components.
    pub rate_deviation: f64,
}

/// Sums over a stretch of time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Sums {
    start_ns: i64,
    end_ns: i64,
    count: f64,
    force: Moments,
    rate: Moments,
}

impl Sums {
    fn add(&mut self, sample: &ImuSample) {
        if self.count == 0.0 {
            self.start_ns = sample.time_ns;
        }
        self.end_ns = sample.time_ns;
        self.count += 1.0;
        self.force.add(self.count, &sample.specific_force);
        self.rate.add(self.count, &sample.angular_velocity);
    }

    fn merge(&mut self, other: &Self) {
        self.end_ns = other.end_ns;
        self.force.merge(self.count, &other.force, other.count);
        self.rate.merge(self.count, &other.rate, other.count);
        self.count += other.count;
    }

    fn seconds(&self) -> f64 {
        self.end_ns.saturating_sub(self.start_ns) as f64 * 1e-9
    }
}

/// Finds rests in samples, one after the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Rests {
    params: RestParams,
    window: Sums,
    /// The previous window, if it was at rest: it is part of the rest once another follows.
    last: Option<Sums>,
    /// `true` if a window at rest preceded the last one.
    has_begun: bool,
    rest: Option<Sums>,
}

impl Rests {
    /// A detector without samples.
    ///
    /// # Errors
    ///
    /// The first parameter outside its range.
    pub fn new(params: RestParams) -> Result<Self, ParamsError> {
        params.check()?;
        Ok(Self { params, window: Sums::default(), last: None, has_begun: false, rest: None })
    }

    /// Adds a sample; returns the rest that ended, if any. A sample that is not finite, or not later than the last,
    /// is ignored.
    pub fn add(&mut self, sample: &ImuSample) -> Option<Rest> {
        let is_finite = (sample.specific_force + sample.angular_velocity).iter().all(|value| value.is_finite());
        if !is_finite || (self.window.count > 0.0 && sample.time_ns <= self.window.end_ns) {
            return None;
        }
        // A gap in the samples ends a rest.
        let gap = sample.time_ns.saturating_sub(self.window.end_ns) as f64 * 1e-9;
        if self.window.count > 0.0 && gap > self.params.window {
            self.window = Sums::default();
            self.window.add(sample);
            return self.end();
        }
        self.window.add(sample);
        if self.window.seconds() < self.params.window {
            return None;
        }
        let window = core::mem::take(&mut self.window);
        if !self.is_rest(&window) {
            return self.end();
        }
        // Without the first and the last window.
        if let Some(last) = self.last.replace(window) {
            if self.has_begun {
                match &mut self.rest {
                    Some(rest) => rest.merge(&last),
                    None => self.rest = Some(last),
                }
            }
            self.has_begun = true;
        }
        None
    }

    /// Returns the rest at the end of the samples, if any.
    pub fn finish(&mut self) -> Option<Rest> {
        self.end()
    }

    fn end(&mut self) -> Option<Rest> {
        self.last = None;
        self.has_begun = false;
        let rest = self.rest.take().filter(|rest| rest.seconds() >= self.params.time)?;
        // The noise of a component, averaged.
        let deviation = |moments: &Moments| ComplexField::sqrt(moments.squares.sum() / (3.0 * rest.count));
        Some(Rest {
            start_ns: rest.start_ns,
            end_ns: rest.end_ns,
            samples: rest.count as u64,
            force: rest.force.mean,
            rate: rest.rate.mean,
            force_deviation: deviation(&rest.force),
            rate_deviation: deviation(&rest.rate),
        })
    }

    /// Returns whether a window is a rest, with the same pose as the previous window.
    fn is_rest(&self, window: &Sums) -> bool {
        let RestParams { rotation, force, .. } = self.params;
        let is_still = window.force.largest_variance(window.count) < force * force
            && window.rate.largest_variance(window.count) < rotation * rotation;
        let moved = |last: &Sums| (window.force.mean - last.force.mean).amax() > force;
        is_still && !self.last.as_ref().is_some_and(moved)
    }
}
