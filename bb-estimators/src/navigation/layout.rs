//! What the errors of a filter are, beside their order.

use super::bounds::{MOST_ROTATION, MOST_VARIANCE};
use super::state::{
    ACCELEROMETER_BIAS, GYROSCOPE_BIAS, NAVIGATION, Optional, POSITION, ROTATION, States, VELOCITY,
};
use crate::attitude::{MAX_ANGULAR_VELOCITY, MAX_SPECIFIC_FORCE};

/// A variance above this part of the largest is that of a filter that is lost, whose covariance rounding may break.
const LOST: f64 = 1e-4;

/// No correction is larger than so many of the largest deviations.
const MOST_DEVIATIONS: f64 = 100.0;

/// Which errors are one quantity, and the largest variance of each that says anything.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation) struct Layout<const N: usize> {
    /// Errors with the same number are one quantity, or refer to it.
    pub(in crate::navigation) blocks: [u8; N],
    /// In the square of the errors' units.
    pub(in crate::navigation) largest: [f64; N],
    /// Above it the filter is lost.
    pub(in crate::navigation) lost: [f64; N],
}

impl<const N: usize> Layout<N> {
    /// Of errors that are all one quantity, and known.
    pub(in crate::navigation) const EMPTY: Self = Self { blocks: [0; N], largest: [0.0; N], lost: [0.0; N] };

    /// That of an [`Eskf`](super::Eskf). A keyframe and the bias of a barometer refer to the pose.
    pub(in crate::navigation) const fn of<S: States>() -> Self {
        let mut layout = Self::EMPTY;
        layout.set((POSITION, 3), 0, MOST_VARIANCE);
        layout.set((VELOCITY, 3), 1, MOST_VARIANCE);
        layout.set((ROTATION, 3), 2, MOST_ROTATION);
        layout.set((ACCELEROMETER_BIAS, 3), 3, MAX_SPECIFIC_FORCE * MAX_SPECIFIC_FORCE);
        layout.set((GYROSCOPE_BIAS, 3), 4, MAX_ANGULAR_VELOCITY * MAX_ANGULAR_VELOCITY);
        let mut first = NAVIGATION;
        let mut i = 0;
        while i < S::OPTIONAL.len() {
            let state = S::OPTIONAL[i];
            let range = (first, state.dimension());
            // A hundred of the largest deviation that its parameter accepts.
            match state {
                Optional::Keyframe => {
                    layout.set((first, 3), 0, MOST_VARIANCE);
                    layout.set((first + 3, 3), 2, MOST_ROTATION);
                }
                Optional::RelativeScale => layout.set(range, 5, 1e4),
                Optional::GnssLeverArm => layout.set(range, 6, 1e8),
                Optional::GnssDelay => layout.set(range, 7, 1e6),
                Optional::WheelScale => layout.set(range, 8, 1e4),
                Optional::HardIron => layout.set(range, 9, 1e4),
                Optional::BarometerBias => layout.set(range, 0, 1e12),
            }
            first += state.dimension();
            i += 1;
        }
        layout
    }

    /// Sets `(first, number)` errors.
    pub(in crate::navigation) const fn set(&mut self, errors: (usize, usize), block: u8, largest: f64) {
        let mut i = errors.0;
        while i < errors.0 + errors.1 {
            self.blocks[i] = block;
            self.largest[i] = largest;
            self.lost[i] = LOST * largest;
            i += 1;
        }
    }

    /// Whether a filter may be off by so much at all. Not if it is not a number.
    #[inline]
    pub(in crate::navigation) fn admits(&self, error: &nalgebra::SVector<f64, N>) -> bool {
        let most = MOST_DEVIATIONS * MOST_DEVIATIONS;
        error.iter().zip(&self.largest).all(|(error, largest)| error * error <= most * largest)
    }
}
