//! The revised AHRS algorithm known from x-io's Fusion library, with six axes or nine.
//!
//! S. O. H. Madgwick, "AHRS algorithms and calibration solutions to facilitate new applications using low-cost MEMS",
//! PhD thesis, University of Bristol, 2014, chapter 7; and the documentation of x-io Technologies' Fusion library, for
//! startup, rejection, recovery and the gyroscope's offset. It is not [`madgwick`](super::madgwick).
//!
//! # Idea
//!
//! A complementary filter: the gyroscope is integrated, and the orientation is turned towards gravity and, only about
//! the vertical, towards magnetic north, at a rate of the gain times the sine of the error.
//!
//! * Startup: the gain decreases from 10 to its value within 3 s.
//! * Rejection: an accelerometer whose direction is farther from the expected one than a threshold is ignored for that
//!   sample; the magnetometer likewise, by its heading.
//! * Recovery: where more than 90 % of the samples are rejected for some seconds, all are taken, until most are right.
//! * Offset: after 3 s of slow rotation the gyroscope's readings are low-passed to its offset.
//!
//! # Differences from the library
//!
//! * The first sample sets tilt and heading, as with all filters here. Startup follows all the same, but not a start
//!   from a known orientation.
//! * The error is taken where the gyroscope leads, not at the previous orientation: what was measured now is compared
//!   with what is expected now. In the library's order a rotation is led by one sample.
//! * Periods are in seconds, not in samples, and the offset's threshold holds for the angular velocity, not for each
//!   of its components: the mounting of the sensor does not matter.

mod filter;
mod offset;
mod params;
mod rejection;
#[cfg(test)]
mod tests;

pub use filter::FusionFilter;
pub use params::FusionParams;

/// Purpose of the filter.
pub const ABOUT: super::About = super::About {
    when: "motion with strong accelerations now and then, little work",
    idea: "feedback in proportion to the error; ignores accelerometer and field where they are far off",
};
