//! Inclination from gravity alone, and heading from the magnetic field if there is one; no gyroscope.
//!
//! Specific force and field are low-passed in the body frame, and show the orientation as the first sample of every
//! filter does, by [`initial_orientation`](super::initial::initial_orientation)'s equations. Source: M. Pedley,
//! "eCompass: tilt compensated electronic compass", Freescale application note AN4248, 2012, of which this is the
//! same without Euler angles and their singularities.
//!
//! What no sensor shows is left alone: without a field, the orientation turns by the least rotation that brings the
//! low-passed specific force upright. In free fall it stays as it is.
//!
//! For sensors that have no gyroscope, and as a measure of what a gyroscope gains. Angular velocities are checked as
//! with all filters, but not used. Every acceleration tilts the estimate, and rotation is followed late by the time
//! constant.

mod filter;
mod params;
#[cfg(test)]
mod tests;

pub use filter::TiltFilter;
pub use params::TiltParams;

/// What the filter is for.
pub const ABOUT: super::About =
    super::About { when: "no gyroscope, slow motion", idea: "gravity and field, low-passed" };
