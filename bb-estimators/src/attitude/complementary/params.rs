//! The tuning of the complementary filter.

use crate::params::params;

params! {
    /// The tuning of [`ComplementaryFilter`](super::ComplementaryFilter).
    pub struct ComplementaryParams {
        /// Time constant with which the tilt follows the accelerometer.
        ///
        /// Small: accelerations tilt the estimate; 0 follows the accelerometer at once. Large: a gyroscope bias tilts it
        /// by bias times this constant, and a wrong start takes that long to go.
        ///
        /// Source: the accelerometer's time constant of VQF (Laidig and Seel, 2023).
        tilt_time_constant: f64 = 3.0, in 0.0..=1e6, unit "s";
        /// Time constant with which the heading follows the magnetometer.
        ///
        /// Small: magnetic disturbances turn the estimate; 0 follows the magnetometer at once. Large: a gyroscope bias
        /// turns it by bias times this constant, and a wrong start takes that long to go.
        ///
        /// Source: the magnetometer's time constant of VQF.
        heading_time_constant: f64 = 9.0, in 0.0..=1e6, unit "s";
        /// Correction of the heading by the magnetic field.
        ///
        /// Off: magnetic samples are ignored and the heading drifts with the gyroscope's bias. On: heading is the
        /// magnetic one, and follows magnetic disturbances that outlast the time constant.
        ///
        /// Source: six or nine axes, as in the literature.
        magnetometer: bool = true;
    }
}
