//! The tuning of the filter without a gyroscope.

use crate::params::params;

params! {
    /// The tuning of [`TiltFilter`](super::TiltFilter).
    pub struct TiltParams {
        /// Time constant of the low-pass on specific force and field.
        ///
        /// Small: noise and accelerations tilt the estimate; 0 takes each sample as it is. Large: rotation is followed
        /// late.
        ///
        /// Source: the low-pass of the application note, some samples at 50 Hz.
        time_constant: f64 = 0.1, in 0.0..=1e6, unit "s";
        /// Heading from the magnetic field.
        ///
        /// Off: magnetic samples are ignored and rotation about the vertical is not seen. On: heading is the magnetic
        /// one, and follows magnetic disturbances.
        ///
        /// Source: the application note's inclinometer and compass.
        magnetometer: bool = true;
    }
}
