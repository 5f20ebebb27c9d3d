//! The tuning of the filter without a gyroscope.

use crate::attitude::ParamsError;
use crate::attitude::params::accept;

/// The tuning of [`TiltFilter`](super::TiltFilter).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "runtime", derive(bb_core::Options))]
pub struct TiltParams {
    /// Time constant of the low-pass on specific force and field.
    ///
    /// Small: noise and accelerations tilt the estimate; 0 takes each sample as it is. Large: rotation is followed
    /// late. From 0 to 1e6.
    ///
    /// Unit: s. Default: 0.1. Source: the low-pass of the application note, some samples at 50 Hz.
    #[cfg_attr(feature = "runtime", option(default = Self::default().time_constant, range = 0.0..=1e6, unit = "s"))]
    pub time_constant: f64,
    /// Whether the magnetic field shows the heading.
    ///
    /// Off: magnetic samples are ignored and rotation about the vertical is not seen. On: heading is the magnetic one,
    /// and follows magnetic disturbances.
    ///
    /// Unit: none. Default: on. Source: the application note's inclinometer and compass.
    #[cfg_attr(feature = "runtime", option(default = Self::default().magnetometer))]
    pub magnetometer: bool,
}

impl Default for TiltParams {
    fn default() -> Self {
        Self { time_constant: 0.1, magnetometer: true }
    }
}

impl TiltParams {
    pub(super) fn check(&self) -> Result<(), ParamsError> {
        accept("time_constant", self.time_constant, (0.0, 1e6), "s")
    }
}
