//! The tuning of the complementary filter.

use crate::attitude::ParamsError;
use crate::attitude::params::accept;

/// The tuning of [`ComplementaryFilter`](super::ComplementaryFilter).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "runtime", derive(bb_core::Options))]
pub struct ComplementaryParams {
    /// How soon the tilt follows the accelerometer.
    ///
    /// Small: accelerations tilt the estimate; 0 follows the accelerometer at once. Large: a gyroscope bias
    /// tilts it by bias times this constant, and a wrong start takes that long to go. From 0 to 1e6.
    ///
    /// Unit: s. Default: 3. Source: the accelerometer's time constant of VQF (Laidig and Seel, 2023).
    #[cfg_attr(feature = "runtime", option(default = Self::default().tilt_time_constant, range = 0.0..=1e6, unit = "s"))]
    pub tilt_time_constant: f64,
    /// How soon the heading follows the magnetometer.
    ///
    /// Small: magnetic disturbances turn the estimate; 0 follows the magnetometer at once. Large: a gyroscope
    /// bias turns it by bias times this constant, and a wrong start takes that long to go. From 0 to 1e6.
    ///
    /// Unit: s. Default: 9. Source: the magnetometer's time constant of VQF.
    #[cfg_attr(feature = "runtime", option(default = Self::default().heading_time_constant, range = 0.0..=1e6, unit = "s"))]
    pub heading_time_constant: f64,
    /// Whether the magnetic field corrects the heading.
    ///
    /// Off: magnetic samples are ignored and the heading drifts with the gyroscope's bias. On: heading is the
    /// magnetic one, and follows magnetic disturbances that outlast the time constant.
    ///
    /// Unit: none. Default: on. Source: six or nine axes, as in the literature.
    #[cfg_attr(feature = "runtime", option(default = Self::default().magnetometer))]
    pub magnetometer: bool,
}

impl Default for ComplementaryParams {
    fn default() -> Self {
        Self { tilt_time_constant: 3.0, heading_time_constant: 9.0, magnetometer: true }
    }
}

impl ComplementaryParams {
    pub(super) fn check(&self) -> Result<(), ParamsError> {
        accept("tilt_time_constant", self.tilt_time_constant, (0.0, 1e6), "s")?;
        accept("heading_time_constant", self.heading_time_constant, (0.0, 1e6), "s")
    }
}
