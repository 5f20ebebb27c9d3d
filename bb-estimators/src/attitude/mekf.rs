//! A self-calibrating multiplicative error-state Kalman filter, with six axes or nine.
//!
//! F. L. Markley, "Attitude error representations for Kalman filtering", Journal of Guidance, Control, and Dynamics
//! 26(2), 2003, for the error state; D. Laidig, T. Seel, "VQF: Highly accurate IMU orientation estimation with bias
//! estimation and magnetic disturbance rejection", Information Fusion 91, 2023, for typical sensor errors, and for
//! rest and disturbances. `book/src/laboratory/attitude.md` has the ablations and the comparison.
//!
//! Nine states: the rotation error in the world, the gyroscope's bias, the horizontal velocity, and the lag of the
//! magnetometer. Samples are integrated at once, errors propagated once per window. The offset of the magnetometer is a
//! hypothesis beside the filter; see `offset.rs`. `numbers.rs` has all numbers, and `book/src/explanation/attitude-filter.md` the equations.

mod doubt;
mod errors;
mod field;
mod filter;
mod numbers;
mod offset;
mod params;
mod rest;
#[cfg(test)]
mod tests;
mod window;

pub use filter::MekfFilter;
pub use params::{Magnetometer, MekfParams};

/// Purpose of the filter.
pub const ABOUT: super::About = super::About {
    when: "first choice: the most accurate from rest and in motion, without calibration, with a covariance",
    idea: "an error-state Kalman filter that also finds the gyroscope's bias, the body's velocity, and the magnetometer's offset and lag",
};
