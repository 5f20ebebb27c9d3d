//! Madgwick's gradient-descent filter, with six axes or nine.
//!
//! S. O. H. Madgwick, "An efficient orientation filter for inertial and inertial/magnetic sensor arrays",
//! internal report, University of Bristol, 2010; S. O. H. Madgwick, A. J. L. Harrison, R. Vaidyanathan,
//! "Estimation of IMU and MARG orientation using a gradient descent algorithm", ICORR 2011.
//!
//! The gyroscope is integrated. Against its drift, every sample turns the orientation by a step of fixed length down
//! the gradient of the error in explaining gravity and the magnetic field.
//!
//! # Differences from the papers
//!
//! * World and field reference are ENU, `b = (0, b_n, b_z)`, not with x to the north.
//! * The gradient is the one on the unit sphere. The papers' gradient in ℝ⁴ has one more component, along the
//!   quaternion, which the normalisation after the step removes but which shortens the step before that by an
//!   amount that depends on how the sensor is mounted. Without it, it is not.
//! * The gradient is taken where the gyroscope leads, not at the previous orientation: what was measured now is
//!   compared with what is expected now. In the papers' order a steady rotation is led by one sample.
//! * The C code that was published along with the report also halves `b`, and with that the pull of the
//!   magnetic field. The report's objective does not, and neither does this.

mod filter;
mod params;
#[cfg(test)]
mod tests;

pub use filter::MadgwickFilter;
pub use params::MadgwickParams;

/// Purpose of the filter.
pub const ABOUT: super::About = super::About {
    when: "the least work; to compare with others",
    idea: "a step of fixed length down the gradient of how badly the orientation explains gravity and field",
};
