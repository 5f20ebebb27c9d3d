//! Rest: the sensor reads what it has read for some time, and turns by no more than its bias.

use nalgebra::Vector3;

use super::numbers::{BRIEF_S, OUTLIER, REST_FORCE, REST_RATE, REST_TIME_S};
use crate::attitude::Real;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Rest<T: Real> {
    rate: Vector3<T>,
    force: Vector3<T>,
    /// The square of the largest mean rate that may be a bias, rad²/s².
    most: T,
    still_s: T,
}

impl<T: Real> Rest<T> {
    pub(super) fn new(rate: &Vector3<T>, force: &Vector3<T>) -> Self {
        Self { rate: *rate, force: *force, most: T::ZERO, still_s: T::ZERO }
    }

    /// Takes note of the deviation of the bias.
    pub(super) fn expect(&mut self, deviation: T) {
        let most = T::of(REST_RATE) + T::of(OUTLIER) * deviation;
        self.most = most * most;
    }

    /// Adds a sample, and its angular velocity without the bias.
    pub(super) fn add(&mut self, dt: T, measured: &Vector3<T>, force: &Vector3<T>, rate: &Vector3<T>) {
        let part = dt / (dt + T::of(BRIEF_S));
        self.rate += (measured - self.rate) * part;
        self.force += (force - self.force) * part;
        let off = measured - self.rate;
        let is_still = off.norm_squared() <= T::of(REST_RATE * REST_RATE)
            && (force - self.force).norm_squared() <= T::of(REST_FORCE * REST_FORCE)
            && (rate - off).norm_squared() <= self.most;
        self.still_s = if is_still { self.still_s + dt } else { T::ZERO };
    }

    pub(super) fn is_still(&self) -> bool {
        self.still_s > T::ZERO
    }

    pub(super) fn is_detected(&self) -> bool {
        self.still_s > T::of(REST_TIME_S)
    }
}
