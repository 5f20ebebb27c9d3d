//! Properties of a filter's errors besides their order.

use super::numbers::{LOST, MOST_DEVIATIONS, MOST_ROTATION, MOST_VARIANCE};
use super::state::{
    ACCELEROMETER_BIAS, GYROSCOPE_BIAS, NAVIGATION, Optional, POSITION, ROTATION, States, VELOCITY,
};
use crate::attitude::{MAX_ANGULAR_VELOCITY, MAX_SPECIFIC_FORCE};

/// The largest meaningful variance of each error.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation) struct Layout<const N: usize> {
    /// Largest variances, in the squares of the errors' units.
    pub(in crate::navigation) largest: [f64; N],
    /// Above this variance the filter is lost.
    pub(in crate::navigation) lost: [f64; N],
}

impl<const N: usize> Layout<N> {
    /// A layout in which all errors are known.
    pub(in crate::navigation) const EMPTY: Self = Self { largest: [0.0; N], lost: [0.0; N] };

    /// The layout of an [`EskfFilter`](super::EskfFilter).
    pub(in crate::navigation) const fn of<S: States>() -> Self {
        let mut layout = Self::EMPTY;
        layout.set((POSITION, 3), MOST_VARIANCE);
        layout.set((VELOCITY, 3), MOST_VARIANCE);
        layout.set((ROTATION, 3), MOST_ROTATION);
        layout.set((ACCELEROMETER_BIAS, 3), MAX_SPECIFIC_FORCE * MAX_SPECIFIC_FORCE);
        layout.set((GYROSCOPE_BIAS, 3), MAX_ANGULAR_VELOCITY * MAX_ANGULAR_VELOCITY);
        let mut first = NAVIGATION;
        let mut i = 0;
        while i < S::OPTIONAL.len() {
            let state = S::OPTIONAL[i];
            let range = (first, state.dimension());
            // A hundred times the largest deviation that its parameter accepts.
            match state {
                Optional::Keyframe => {
                    layout.set((first, 3), MOST_VARIANCE);
                    layout.set((first + 3, 3), MOST_ROTATION);
                }
                Optional::RelativeScale => layout.set(range, 1e4),
                Optional::GnssLeverArm => layout.set(range, 1e8),
                Optional::GnssDelay => layout.set(range, 1e6),
                Optional::WheelScale => layout.set(range, 1e4),
                Optional::WheelMounting => layout.set(range, MOST_ROTATION),
                Optional::HardIron => layout.set(range, 1e4),
                Optional::BarometerBias => layout.set(range, 1e12),
            }
            first += state.dimension();
            i += 1;
        }
        layout
    }

    /// Sets `(first, number)` errors.
    pub(in crate::navigation) const fn set(&mut self, errors: (usize, usize), largest: f64) {
        let mut i = errors.0;
        while i < errors.0 + errors.1 {
            self.largest[i] = largest;
            self.lost[i] = LOST * largest;
            i += 1;
        }
    }

    /// Returns whether a filter can be wrong by this correction. `false` for NaN.
    #[inline]
    pub(in crate::navigation) fn admits(&self, error: &nalgebra::SVector<f64, N>) -> bool {
        let most = MOST_DEVIATIONS * MOST_DEVIATIONS;
        error.iter().zip(&self.largest).all(|(error, largest)| error * error <= most * largest)
    }
}
