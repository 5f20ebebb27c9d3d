//! What is estimated: the states and where each begins, and an estimate of them.

mod estimate;
mod states;

pub use estimate::{Estimate, Keyframe};
pub(super) use states::distinct;
pub use states::{
    ACCELEROMETER_BIAS, GYROSCOPE_BIAS, NAVIGATION, Navigation, Optional, POSITION, ROTATION, States, VELOCITY,
    Wheeled, offset,
};
