//! The estimated states, their positions in the error vector, and the estimate.

mod estimate;
mod states;

pub use estimate::{Estimate, Keyframe};
pub use states::{
    ACCELEROMETER_BIAS, Aided, Complete, GYROSCOPE_BIAS, NAVIGATED, NAVIGATION, Navigated, Navigation, Optional,
    POSITION, ROTATION, States, VELOCITY, Vehicle, offset,
};
pub(super) use states::{MOST_ERRORS, PoseErrors, distinct, pose_errors};
