//! Properties of a filter's errors besides their order.

use super::bounds::{MOST_ROTATION, MOST_VARIANCE};
use super::state::{
    ACCELEROMETER_BIAS, GYROSCOPE_BIAS, NAVIGATION, Optional, POSITION, ROTATION, States, VELOCITY,
};
use crate::attitude::{MAX_ANGULAR_VELOCITY, MAX_SPECIFIC_FORCE};

/// A filter with a variance above this fraction of the largest is lost, and rounding may break its covariance.
const LOST: f64 = 1e-4;

/// The block of the heading in [`Quantities::of_heading`]; the others have smaller numbers.
const OF_HEADING: u8 = 10;

/// The number of blocks.
pub(in crate::navigation) const BLOCKS: usize = OF_HEADING as usize + 2;

/// The block of errors that explain no misfit.
const NEVER_RAISED: u8 = u8::MAX;

/// A correction is at most this many times the largest deviation.
const MOST_DEVIATIONS: f64 = 100.0;

/// The largest variance of a scale that a jump leaves behind: three deviations are a third, as a tyre that bursts. One that is off by
/// more is the fault of what it multiplies: a velocity that is ten times too large is not explained by wheels of a tenth of their size.
pub(in crate::navigation) const MOST_SCALE: f64 = 0.01;

/// Groups the errors by quantity, with the largest meaningful variance of each.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation) struct Layout<const N: usize> {
    /// Errors with the same number belong to one quantity or refer to it.
    pub(in crate::navigation) blocks: [u8; N],
    /// The blocks of position and velocity.
    pub(in crate::navigation) motion: [u8; 2],
    /// The block of the attitude, which leads the velocity.
    pub(in crate::navigation) attitude: u8,
    /// The error of the heading, one of the attitude.
    pub(in crate::navigation) heading: usize,
    /// The largest variance to which a jump raises an error.
    pub(in crate::navigation) most_jump: [f64; N],
    /// In the squares of the errors' units.
    pub(in crate::navigation) largest: [f64; N],
    /// Above this variance the filter is lost.
    pub(in crate::navigation) lost: [f64; N],
}

impl<const N: usize> Layout<N> {
    /// A layout in which all errors form one quantity that is known.
    pub(in crate::navigation) const EMPTY: Self = Self {
        blocks: [0; N],
        motion: [0; 2],
        attitude: 0,
        heading: 0,
        most_jump: [f64::INFINITY; N],
        largest: [0.0; N],
        lost: [0.0; N],
    };

    /// The layout of an [`Eskf`](super::Eskf). The keyframe and the barometer's bias refer to the pose.
    pub(in crate::navigation) const fn of<S: States>() -> Self {
        let mut layout = Self::EMPTY;
        layout.motion = [0, 1];
        (layout.attitude, layout.heading) = (2, ROTATION + 2);
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
                Optional::RelativeScale => {
                    layout.set(range, 5, 1e4);
                    layout.most_jump[first] = MOST_SCALE;
                }
                Optional::GnssLeverArm => layout.set(range, 6, 1e8),
                Optional::GnssDelay => layout.set(range, 7, 1e6),
                Optional::WheelScale => {
                    layout.set(range, 8, 1e4);
                    layout.most_jump[first] = MOST_SCALE;
                }
                Optional::WheelMounting => layout.set(range, 11, MOST_ROTATION),
                Optional::HardIron => layout.set(range, 9, 1e4),
                Optional::BarometerBias => layout.set(range, 0, 1e12),
            }
            first += state.dimension();
            i += 1;
        }
        layout
    }

    /// Layout for code that is compiled once for all filters.
    pub(in crate::navigation) fn quantities(&self) -> Quantities<'_> {
        let Self { blocks, motion, attitude, heading, most_jump, largest, lost } = self;
        Quantities {
            blocks,
            motion: *motion,
            attitude: *attitude,
            heading: *heading,
            most_jump,
            largest,
            lost,
            is_of_heading: false,
        }
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

/// A [`Layout`] of any size.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation) struct Quantities<'a> {
    blocks: &'a [u8],
    pub(in crate::navigation) motion: [u8; 2],
    pub(in crate::navigation) attitude: u8,
    pub(in crate::navigation) heading: usize,
    pub(in crate::navigation) most_jump: &'a [f64],
    pub(in crate::navigation) largest: &'a [f64],
    pub(in crate::navigation) lost: &'a [f64],
    is_of_heading: bool,
}

impl Quantities<'_> {
    /// For a measurement that observes nothing of the attitude but its heading: it raises the heading alone.
    pub(in crate::navigation) fn of_heading(&self) -> Self {
        Self { is_of_heading: true, ..*self }
    }

    /// The block that an error belongs to.
    pub(in crate::navigation) fn block(&self, error: usize) -> u8 {
        match self.blocks[error] {
            block if !self.is_of_heading || block != self.attitude => block,
            _ if error == self.heading => OF_HEADING,
            _ => NEVER_RAISED,
        }
    }
}
