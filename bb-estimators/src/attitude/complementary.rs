//! A complementary filter on quaternions, with six axes or nine.
//!
//! The gyroscope is integrated exactly for the sample's time. Then the orientation is turned by a fraction of its
//! remaining difference from the drift-free sensors: about a horizontal axis towards gravity, and about the vertical
//! towards magnetic north. The fraction is that of a first-order low-pass, `1 - exp(-dt/τ)`, so the gyroscope
//! dominates above the frequency `1/(2πτ)` and the other sensor below.
//!
//! Two ideas come from others:
//!
//! * The two corrections are separate, in the world frame, so that a magnetic disturbance can never tilt the
//!   orientation: R. G. Valenti, I. Dryanovski, J. Xiao, "Keeping a Good Attitude: A Quaternion-Based
//!   Orientation Filter for IMUs and MARGs", Sensors 15(8):19302, 2015. Their gains are fixed numbers; time
//!   constants in their place do not change with the sample rate.
//! * The low-pass for the tilt works on the specific force as a vector in the world frame, with its length, so
//!   that accelerations cancel as the motion goes to and fro: D. Laidig, T. Seel, "VQF: Highly accurate IMU
//!   orientation estimation with bias estimation and magnetic disturbance rejection", Information Fusion 91,
//!   2023. Theirs is of second order. The specific force must be in m/s².

mod filter;
mod params;
#[cfg(test)]
mod tests;

pub use filter::ComplementaryFilter;
pub use params::ComplementaryParams;

/// Purpose of the filter.
pub const ABOUT: super::About = super::About {
    when: "few numbers that are easy to choose, little work",
    idea: "the gyroscope for short times, gravity and field for long ones, each through a first-order low-pass",
};
