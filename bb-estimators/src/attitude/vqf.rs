//! VQF, the versatile quaternion-based filter, with six axes or nine.
//!
//! D. Laidig, T. Seel, "VQF: Highly accurate IMU orientation estimation with bias estimation and magnetic
//! disturbance rejection", Information Fusion 91, 2023: the online filter with all its parts and published
//! parameters.
//!
//! # Idea
//!
//! The orientation is a product of three rotations: `world_from_body = heading ⊗ level ⊗ inertial_from_body`.
//!
//! * `inertial_from_body` integrates the gyroscope minus its bias. Its frame drifts slowly, as a whole.
//! * In that frame gravity is constant except for the drift, so that a strong low-pass of the specific force, as a
//!   vector with its length, leaves gravity alone, whatever the rotation of the body. `level` turns it upright.
//! * `heading`, an angle about the vertical, goes to that of the field by a first-order filter. A disturbed field
//!   cannot tilt.
//!
//! A Kalman filter estimates the gyroscope's bias: at rest from the gyroscope's reading, in motion from the
//! corrections of `level`. The field's norm and dip show whether it is disturbed; it is then ignored for a time, and
//! followed slowly after that. A new field becomes the reference once it has been seen in motion for long enough.
//!
//! # Differences from the paper
//!
//! None of them moves the orientation by more than 0.02° RMS on any of ten trials of BROAD that start at rest. If
//! started in the middle of fast motion, they move it by up to 0.5° RMS, with neither variant better; there, the
//! published code differs from itself by up to 0.4° when the sensor is mounted differently.
//!
//! * Limits hold for the length of a vector, where the published code takes each component by itself, which depends
//!   on how the sensor is mounted and on where north is. For the same reason the bias's covariance nears its initial
//!   value as that of a Gauss–Markov process does, instead of growing up to it by components.
//! * The Butterworth low-passes are in state-variable form. The transfer function is the same, but its states are
//!   signals, so that the sample's time may change from one to the next, and no small differences of large numbers
//!   appear.
//! * Time comes from the stamps. Coefficients are recomputed when it differs by more than 1/64 from that of the
//!   coefficients at hand.
//! * Started from a known orientation, the low-pass starts with gravity in it, and no field sets the heading at once.

mod bias;
mod coefficients;
mod field;
mod filter;
mod heading;
mod low_pass;
mod params;
mod rest;
#[cfg(test)]
mod tests;

pub use filter::VqfFilter;
pub use params::VqfParams;

/// Purpose of the filter.
pub const ABOUT: super::About = super::About {
    when: "to agree with other programs that use VQF's published defaults",
    idea: "gravity by a strong low-pass in the gyroscope's frame, heading apart; finds bias, rest and disturbances",
};

/// rad.
const DEGREE: f64 = core::f64::consts::PI / 180.0;
