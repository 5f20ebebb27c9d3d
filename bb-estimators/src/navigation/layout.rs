//! Properties of a filter's errors besides their order.

use super::bounds::{MOST_ROTATION, MOST_VARIANCE};
use super::state::{
    ACCELEROMETER_BIAS, GYROSCOPE_BIAS, NAVIGATION, Optional, POSITION, ROTATION, States, VELOCITY,
};
use crate::attitude::{MAX_ANGULAR_VELOCITY, MAX_SPECIFIC_FORCE};

/// A filter with a variance above this fraction of the largest is lost, and rounding may break its covariance.
const LOST: f64 = 1e-4;

/// A correction is at most this many times the largest deviation.
const MOST_DEVIATIONS: f64 = 100.0;

/// Groups the errors by quantity, with the largest meaningful variance of each.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation) struct Layout<const N: usize> {
    /// Errors with the same number belong to one quantity or refer to it.
    pub(in crate::navigation) blocks: [u8; N],
    /// The blocks of position and velocity.
    pub(in crate::navigation) motion: [u8; 2],
    /// In the squares of the errors' units.
    pub(in crate::navigation) largest: [f64; N],
    /// Above this variance the filter is lost.
    pub(in crate::navigation) lost: [f64; N],
}

impl<const N: usize> Layout<N> {
    /// A layout in which all errors form one quantity that is known.
    pub(in crate::navigation) const EMPTY: Self =
        Self { blocks: [0; N], motion: [0; 2], largest: [0.0; N], lost: [0.0; N] };

    /// The layout of an [`Eskf`](super::Eskf). The keyframe and the barometer's bias refer to the pose.
    pub(in crate::navigation) const fn of<S: States>() -> Self {
        let mut layout = Self::EMPTY;
        layout.motion = [0, 1];
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
            // A hundred times the largest deviation that its parameter accepts.
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

    /// Whether a filter can be wrong by this correction. `false` for NaN.
    #[inline]
    pub(in crate::navigation) fn admits(&self, error: &nalgebra::SVector<f64, N>) -> bool {
        let most = MOST_DEVIATIONS * MOST_DEVIATIONS;
        error.iter().zip(&self.largest).all(|(error, largest)| error * error <= most * largest)
    }
}
