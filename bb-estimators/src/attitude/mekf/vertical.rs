//! The vertical given by the mean specific force, and when it overrules the tilt.
//!
//! A velocity stays bounded, so the mean of R f over a time t is the vertical up to the change of velocity over g t,
//! rad. The Kalman filter knows that too, but only to first order; a tilt that is off by more restarts.

use nalgebra::{UnitQuaternion, Vector3};

use super::{GRAVITY, INITIAL_TILT};
use crate::attitude::Real;

/// A mean is over this time, s.
const MEAN_S: f64 = 2.0;

/// The slope of a mean beyond which the tilt is wrong: 30°, more than any motion of that time accelerates by.
const MAX_SLOPE: f64 = 0.577;

/// A start is trusted from this time on, s: a few samples after the first.
const LEAST_START_S: f64 = 0.05;

/// How much the velocity may have changed since a start, m/s: a hand that shakes a sensor.
const START_VELOCITY: f64 = 1.4;

/// The mean of a start that leans by less leaves it unchanged, rad: levelling costs what the errors have learnt since.
const MAX_START_SLOPE: f64 = 0.1;

/// A mean of less than this fraction of gravity shows no vertical: free fall.
const FREE_FALL: f64 = 0.5;

/// The same at a start. Since the first sample has no claim to be better than the mean of all, it takes less: rounding
/// and noise.
const FREE_FALL_AT_START: f64 = 0.1;

/// The tilt contradicted by the mean specific force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Contradiction<T> {
    /// The tilt of the first sample; the mean is the vertical up to this deviation, rad.
    Start(Vector3<T>, T),
    /// The tilt of a filter that has run for long.
    Tilt(Vector3<T>),
}

/// The recent mean specific force, in the world.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Vertical<T> {
    /// ∫ R f dt, m/s.
    sum: Vector3<T>,
    /// The duration of the mean, s.
    duration: T,
    /// Whether the filter started from a specific force when the mean began.
    is_start: bool,
}

impl<T: Real> Vertical<T> {
    pub(super) fn new(is_start: bool) -> Self {
        Self { sum: Vector3::zeros(), duration: T::ZERO, is_start }
    }

    /// Adds a window's ∫ R f dt, after the world was corrected.
    pub(super) fn add(
        &mut self,
        dt: T,
        correction: &UnitQuaternion<T>,
        force: &Vector3<T>,
    ) -> Option<Contradiction<T>> {
        self.sum = correction * self.sum + force;
        self.duration += dt;
        let (sum, weight) = (self.sum, T::of(GRAVITY) * self.duration);
        let is_complete = self.duration > T::of(MEAN_S);
        let was_start = self.is_start;
        if is_complete {
            *self = Self::new(false);
        }
        let least = if was_start { FREE_FALL_AT_START } else { FREE_FALL };
        if sum.norm() <= T::of(least) * weight {
            return None;
        }
        let leans = |slope: T| sum.x.hypot(sum.y) > slope * sum.z;
        if was_start {
            let deviation = (T::of(START_VELOCITY) / weight).min(T::of(INITIAL_TILT));
            let believed = self.duration > T::of(LEAST_START_S) || is_complete;
            let most = deviation.min(T::of(MAX_START_SLOPE));
            return (believed && leans(most)).then_some(Contradiction::Start(sum, deviation));
        }
        (is_complete && leans(T::of(MAX_SLOPE))).then_some(Contradiction::Tilt(sum))
    }

    /// The world was turned.
    pub(super) fn turn(&mut self, rotation: &UnitQuaternion<T>) {
        self.sum = rotation * self.sum;
    }

    /// The world was levelled by the mean, so the mean is the vertical from now on.
    pub(super) fn levelled(&mut self) {
        self.sum = Vector3::new(T::ZERO, T::ZERO, self.sum.norm());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a start shows whose specific force is this for a time, s.
    fn start(force: Vector3<f64>, time_s: f64) -> Option<Contradiction<f64>> {
        let mut vertical = Vertical::new(true);
        let window_s = 0.02;
        let windows = (time_s / window_s).round() as i32;
        (0..windows).filter_map(|_| vertical.add(window_s, &UnitQuaternion::identity(), &(force * window_s))).last()
    }

    #[test]
    fn a_start_follows_the_mean_of_all_its_samples() {
        for (lean, levels) in [(0.05_f64, false), (0.15, true), (0.5, true), (2.0, true)] {
            let up = Vector3::new(lean.sin(), 0.0, lean.cos());
            for part in [0.3, 1.0, 2.0] {
                let shown = start(up * GRAVITY * part, 0.2);
                assert_eq!(
                    matches!(shown, Some(Contradiction::Start(..))),
                    levels,
                    "{lean} rad, {part} g: {shown:?}"
                );
            }
            assert_eq!(start(up * GRAVITY * 0.05, 0.2), None, "free fall");
        }
    }
}
