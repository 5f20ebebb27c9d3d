//! The estimated states, their positions in the error vector, and the estimate.

mod estimate;
mod states;

pub use estimate::{Estimate, Keyframe};
pub use states::{
    ACCELEROMETER_BIAS, GYROSCOPE_BIAS, NAVIGATION, Navigation, Optional, POSITION, ROTATION, States, VELOCITY,
    Wheeled, offset,
};
pub(super) use states::{MOST_ERRORS, distinct};
