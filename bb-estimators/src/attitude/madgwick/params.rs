//! The tuning of Madgwick's filter.

use crate::attitude::ParamsError;
use crate::attitude::params::accept;

/// The tuning of [`MadgwickFilter`](super::MadgwickFilter).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "runtime", derive(bb_core::Options))]
pub struct MadgwickParams {
    /// The norm of the correction to the quaternion's derivative; the orientation is corrected at twice this
    /// rate.
    ///
    /// Small: smooth, trusts the gyroscope; below half of its bias the orientation drifts away. Large: bias and
    /// a wrong start are gone soon, but accelerations and field disturbances are followed, and at rest the
    /// orientation trembles by about `2 β dt`. From 0, gyroscope alone, to 1000.
    ///
    /// Unit: rad/s. Default: 0.1. Source: the report's `β = √(3/4) ω̃_β` for a gyroscope that is wrong by
    /// `ω̃_β` = 6.6°/s; the report itself uses 0.041 with nine axes and 0.033 with six for a calibrated sensor.
    #[cfg_attr(feature = "runtime", option(default = Self::default().beta, range = 0.0..=1e3))]
    pub beta: f64,
    /// Whether the magnetic field corrects the heading.
    ///
    /// Off: magnetic samples are ignored and the heading drifts with the gyroscope's bias. On: heading is the
    /// magnetic one, and follows magnetic disturbances.
    ///
    /// Unit: none. Default: on. Source: the report's two forms, for IMU and for MARG.
    #[cfg_attr(feature = "runtime", option(default = Self::default().magnetometer))]
    pub magnetometer: bool,
}

impl Default for MadgwickParams {
    fn default() -> Self {
        Self { beta: 0.1, magnetometer: true }
    }
}

impl MadgwickParams {
    pub(super) fn check(&self) -> Result<(), ParamsError> {
        accept("beta", self.beta, (0.0, 1e3), "rad/s")
    }
}
