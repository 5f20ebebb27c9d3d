//! The tuning of Mahony's filter.

use crate::attitude::ParamsError;
use crate::attitude::params::accept;

/// The tuning of [`MahonyFilter`](super::MahonyFilter).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "runtime", derive(bb_core::Options))]
pub struct MahonyParams {
    /// How fast the orientation turns towards gravity and field: the correcting angular velocity per radian of
    /// error.
    ///
    /// Small: smooth, trusts the gyroscope. Large: a wrong start is gone soon, but accelerations and field
    /// disturbances are followed. From 0, gyroscope alone, to 1000.
    ///
    /// Unit: 1/s. Default: 0.74. Source: the best common setting for inertial and magnetic sensors on bodies in motion,
    /// among those that VQF's authors compare; the experiments of Mahony's paper have 1, on a vehicle in slow flight.
    #[cfg_attr(feature = "runtime", option(default = Self::default().proportional_gain, range = 0.0..=1e3))]
    pub proportional_gain: f64,
    /// How fast the same error becomes gyroscope bias.
    ///
    /// Small: steady, and a bias stays for long. Large: a bias is found soon, but accelerations and field
    /// disturbances are taken for one; above a quarter of the squared proportional gain the orientation swings.
    /// From 0, no bias, to 1000.
    ///
    /// Unit: 1/s². Default: 0.0012. Source: as above; Mahony's paper has 0.3.
    #[cfg_attr(feature = "runtime", option(default = Self::default().integral_gain, range = 0.0..=1e3))]
    pub integral_gain: f64,
    /// Whether the magnetic field corrects the heading.
    ///
    /// Off: magnetic samples are ignored and the heading drifts with what is left of the gyroscope's bias. On:
    /// heading is the magnetic one, and follows magnetic disturbances.
    ///
    /// Unit: none. Default: on. Source: one reference direction or two, as in the paper.
    #[cfg_attr(feature = "runtime", option(default = Self::default().magnetometer))]
    pub magnetometer: bool,
}

impl Default for MahonyParams {
    fn default() -> Self {
        Self { proportional_gain: 0.74, integral_gain: 0.0012, magnetometer: true }
    }
}

impl MahonyParams {
    pub(super) fn check(&self) -> Result<(), ParamsError> {
        accept("proportional_gain", self.proportional_gain, (0.0, 1e3), "1/s")?;
        accept("integral_gain", self.integral_gain, (0.0, 1e3), "1/s²")
    }
}
