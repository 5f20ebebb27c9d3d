//! Rest: the sensor reads what it has read for some time, and turns by no more than its bias.

use nalgebra::Vector3;

use super::numbers::{BRIEF_S, OUTLIER, REST_FORCE, REST_RATE, REST_TIME_S};
use crate::attitude::Real;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Rest<T: Real> {
    rate: Vector3<T>,
    force: Vector3<T>,
    still_s: T,
}

impl<T: Real> Rest<T> {
    pub(super) fn new(rate: &Vector3<T>, force: &Vector3<T>) -> Self {
        Self { rate: *rate, force: *force, still_s: T::ZERO }
    }

    /// Adds a sample, of a gyroscope whose bias is known up to a deviation.
    pub(super) fn add(&mut self, dt: T, rate: &Vector3<T>, force: &Vector3<T>, bias: &Vector3<T>, deviation: T) {
        let part = dt / (dt + T::of(BRIEF_S));
        self.rate += (rate - self.rate) * part;
        self.force += (force - self.force) * part;
        let most = T::of(REST_RATE) + T::of(OUTLIER) * deviation;
        let is_still = (rate - self.rate).norm_squared() <= T::of(REST_RATE * REST_RATE)
            && (force - self.force).norm_squared() <= T::of(REST_FORCE * REST_FORCE)
            && (self.rate - bias).norm_squared() <= most * most;
        self.still_s = if is_still { self.still_s + dt } else { T::ZERO };
    }

    pub(super) fn is_detected(&self) -> bool {
        self.still_s > T::of(REST_TIME_S)
    }

    /// Forgets what was seen: before a gap it tells nothing about the time after it.
    pub(super) fn interrupt(&mut self) {
        self.still_s = T::ZERO;
    }
}
