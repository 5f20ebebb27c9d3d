//! The tuning of the revised AHRS algorithm; defaults are what the library's documentation recommends.

use crate::attitude::ParamsError;
use crate::attitude::params::accept;

/// rad.
const DEGREE: f64 = core::f64::consts::PI / 180.0;

/// The tuning of [`FusionFilter`](super::FusionFilter).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "runtime", derive(bb_core::Options))]
pub struct FusionParams {
    /// How fast the orientation turns towards gravity and field: the correcting angular velocity per sine of the
    /// error.
    ///
    /// Small: trusts the gyroscope; below its bias over a few degrees the orientation drifts away. Large: a wrong
    /// start is gone soon, but accelerations and field disturbances are followed. 0: gyroscope alone. From 0 to
    /// 1000.
    ///
    /// Unit: 1/s. Default: 0.5. Source: the library's `gain`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().gain, range = 0.0..=1000.0))]
    pub gain: f64,
    /// The gyroscope's range, beyond 98 % of which about any axis the filter restarts.
    ///
    /// Small: fast rotation starts it up again and again. Large: a saturated gyroscope goes unseen. 0: never. From
    /// 0 to 1000.
    ///
    /// Unit: rad/s. Default: 0. Source: the library's `gyroscopeRange`; the range is in the sensor's data sheet.
    #[cfg_attr(feature = "runtime", option(default = Self::default().gyroscope_range, range = 0.0..=1000.0, unit = "rad/s"))]
    pub gyroscope_range: f64,
    /// How far the accelerometer's direction may be from the expected one.
    ///
    /// Small: much is ignored, and the gyroscope drifts. Large: accelerations tilt the estimate. 0: nothing is
    /// ignored. From 0 to 1.5.
    ///
    /// Unit: rad. Default: 10°. Source: the library's `accelerationRejection`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().acceleration_rejection, range = 0.0..=1.5, unit = "rad"))]
    pub acceleration_rejection: f64,
    /// How far the field's heading may be from the expected one.
    ///
    /// Small: much is ignored, and the gyroscope drifts. Large: disturbances turn the estimate. 0: nothing is
    /// ignored. From 0 to 1.5.
    ///
    /// Unit: rad. Default: 10°. Source: the library's `magneticRejection`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().magnetic_rejection, range = 0.0..=1.5, unit = "rad"))]
    pub magnetic_rejection: f64,
    /// How long a sensor is ignored, if all its samples are rejected, before all of them are taken.
    ///
    /// Small: long accelerations and disturbances are followed. Large: an estimate that is wrong stays so. From 0
    /// to 1e6.
    ///
    /// Unit: s. Default: 5. Source: the library's `recoveryTriggerPeriod`.
    #[cfg_attr(feature = "runtime", option(default = Self::default().recovery_time, range = 0.0..=1e6, unit = "s"))]
    pub recovery_time: f64,
    /// Whether the gyroscope's offset is found at rest.
    ///
    /// Off: an offset tilts the estimate by offset over gain. On: slow rotation for a long time is taken for one.
    ///
    /// Unit: none. Default: on. Source: the library's offset correction, to be used along with the filter.
    #[cfg_attr(feature = "runtime", option(default = Self::default().offset_correction))]
    pub offset_correction: bool,
    /// The greatest angular velocity, less the offset so far, that counts as rest.
    ///
    /// Small: a larger offset is never found. Large: slow rotation is taken for an offset. From 0 to 1000.
    ///
    /// Unit: rad/s. Default: 3°/s. Source: the library's.
    #[cfg_attr(feature = "runtime", option(default = Self::default().rest_angular_velocity, range = 0.0..=1000.0, unit = "rad/s"))]
    pub rest_angular_velocity: f64,
    /// How long the rotation has to be that slow to be rest.
    ///
    /// Small: a pause is taken for rest. Large: short rests are not used. From 0 to 1e6.
    ///
    /// Unit: s. Default: 3. Source: the library's.
    #[cfg_attr(feature = "runtime", option(default = Self::default().rest_time, range = 0.0..=1e6, unit = "s"))]
    pub rest_time: f64,
    /// Whether the magnetic field corrects the heading.
    ///
    /// Off: magnetic samples are ignored and the heading drifts with what is left of the gyroscope's offset. On:
    /// heading is the magnetic one.
    ///
    /// Unit: none. Default: on. Source: the library's two updates.
    #[cfg_attr(feature = "runtime", option(default = Self::default().magnetometer))]
    pub magnetometer: bool,
}

impl Default for FusionParams {
    fn default() -> Self {
        Self {
            gain: 0.5,
            gyroscope_range: 0.0,
            acceleration_rejection: 10.0 * DEGREE,
            magnetic_rejection: 10.0 * DEGREE,
            recovery_time: 5.0,
            offset_correction: true,
            rest_angular_velocity: 3.0 * DEGREE,
            rest_time: 3.0,
            magnetometer: true,
        }
    }
}

impl FusionParams {
    pub(super) fn check(&self) -> Result<(), ParamsError> {
        accept("gain", self.gain, (0.0, 1000.0), "1/s")?;
        accept("gyroscope_range", self.gyroscope_range, (0.0, 1000.0), "rad/s")?;
        accept("acceleration_rejection", self.acceleration_rejection, (0.0, 1.5), "rad")?;
        accept("magnetic_rejection", self.magnetic_rejection, (0.0, 1.5), "rad")?;
        accept("recovery_time", self.recovery_time, (0.0, 1e6), "s")?;
        accept("rest_angular_velocity", self.rest_angular_velocity, (0.0, 1000.0), "rad/s")?;
        accept("rest_time", self.rest_time, (0.0, 1e6), "s")
    }
}
