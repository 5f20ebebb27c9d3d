//! The tuning of Madgwick's filter.

use crate::params::params;

params! {
    /// The tuning of [`MadgwickFilter`](super::MadgwickFilter).
    pub struct MadgwickParams {
        /// The norm of the correction to the quaternion's derivative; the orientation is corrected at twice this rate.
        ///
        /// Small: smooth, trusts the gyroscope; below half of its bias the orientation drifts away. Large: bias and a
        /// wrong start are gone soon, but accelerations and field disturbances are followed, and at rest the orientation
        /// trembles by about `2 β dt`. 0: gyroscope alone.
        ///
        /// Source: the report's `β = √(3/4) ω̃_β` for a gyroscope that is wrong by `ω̃_β` = 6.6°/s; the report itself
        /// uses 0.041 with nine axes and 0.033 with six for a calibrated sensor.
        beta: f64 = 0.1, in 0.0..=1e3, unit "rad/s";
        /// Correction of the heading by the magnetic field.
        ///
        /// Off: magnetic samples are ignored and the heading drifts with the gyroscope's bias. On: heading is the
        /// magnetic one, and follows magnetic disturbances.
        ///
        /// Source: the report's two forms, for IMU and for MARG.
        magnetometer: bool = true;
    }
}
