//! The tuning of the revised AHRS algorithm; defaults are what the library's documentation recommends.

use crate::params::params;

/// rad.
const DEGREE: f64 = core::f64::consts::PI / 180.0;

params! {
    /// The tuning of [`FusionFilter`](super::FusionFilter).
    pub struct FusionParams {
        /// Speed at which the orientation turns towards gravity and field: the correcting angular velocity per sine of
        /// the error.
        ///
        /// Small: trusts the gyroscope; below its bias over a few degrees the orientation drifts away. Large: a wrong
        /// start is gone soon, but accelerations and field disturbances are followed. 0: gyroscope alone.
        ///
        /// Source: the library's `gain`.
        gain: f64 = 0.5, in 0.0..=1000.0, plain "1/s";
        /// The gyroscope's range, beyond 98 % of which about any axis the filter restarts.
        ///
        /// Small: fast rotation starts it up again and again. Large: a saturated gyroscope goes unseen. 0: never.
        ///
        /// Source: the library's `gyroscopeRange`; the range is in the sensor's data sheet.
        gyroscope_range: f64 = 0.0, in 0.0..=1000.0, unit "rad/s";
        /// Largest deviation of the accelerometer's direction from the expected one.
        ///
        /// Small: much is ignored, and the gyroscope drifts. Large: accelerations tilt the estimate. 0: nothing is
        /// ignored.
        ///
        /// Source: the library's `accelerationRejection`.
        acceleration_rejection: f64 = 10.0 * DEGREE, in 0.0..=1.5, shown "10°", unit "rad";
        /// Largest deviation of the field's heading from the expected one.
        ///
        /// Small: much is ignored, and the gyroscope drifts. Large: disturbances turn the estimate. 0: nothing is
        /// ignored.
        ///
        /// Source: the library's `magneticRejection`.
        magnetic_rejection: f64 = 10.0 * DEGREE, in 0.0..=1.5, shown "10°", unit "rad";
        /// Time for which a sensor is ignored, if all its samples are rejected, before all of them are taken.
        ///
        /// Small: long accelerations and disturbances are followed. Large: an estimate that is wrong stays so.
        ///
        /// Source: the library's `recoveryTriggerPeriod`.
        recovery_time: f64 = 5.0, in 0.0..=1e6, unit "s";
        /// Estimation of the gyroscope's offset at rest.
        ///
        /// Off: an offset tilts the estimate by offset over gain. On: slow rotation for a long time is mistaken for one.
        ///
        /// Source: the library's offset correction, to be used along with the filter.
        offset_correction: bool = true;
        /// The largest angular velocity, minus the current offset, that counts as rest.
        ///
        /// Small: a larger offset is never found. Large: slow rotation is mistaken for an offset.
        ///
        /// Source: the library's.
        rest_angular_velocity: f64 = 3.0 * DEGREE, in 0.0..=1000.0, shown "3°/s", unit "rad/s";
        /// Time for which the rotation must be this slow to count as rest.
        ///
        /// Small: a pause is mistaken for rest. Large: short rests are not used.
        ///
        /// Source: the library's.
        rest_time: f64 = 3.0, in 0.0..=1e6, unit "s";
        /// Correction of the heading by the magnetic field.
        ///
        /// Off: magnetic samples are ignored and the heading drifts with what is left of the gyroscope's offset. On:
        /// heading is the magnetic one.
        ///
        /// Source: the library's two updates.
        magnetometer: bool = true;
    }
}
