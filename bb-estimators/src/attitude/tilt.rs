//! Inclination from gravity alone, and heading from the magnetic field if there is one; no gyroscope.
//!
//! Specific force and field are low-passed in the body frame, and give the orientation like the first sample of every
//! filter, by the equations of [`initial_orientation`](super::initial::initial_orientation). Source: M. Pedley,
//! "eCompass: tilt compensated electronic compass", Freescale application note AN4248, 2012; this is equivalent,
//! without Euler angles and their singularities.
//!
//! Unobserved directions are left alone: without a field, the orientation turns by the smallest rotation that brings
//! the low-passed specific force upright. In free fall it does not change.
//!
//! For sensors without a gyroscope, and as a baseline for the benefit of one. Angular velocities are checked as in
//! all filters, but not used. Every acceleration tilts the estimate, and rotation is followed with a delay of the
//! time constant.

mod filter;
mod params;
#[cfg(test)]
mod tests;

pub use filter::TiltFilter;
pub use params::TiltParams;

/// Purpose of the filter.
pub const ABOUT: super::About =
    super::About { when: "no gyroscope, slow motion", idea: "gravity and field, low-passed" };
