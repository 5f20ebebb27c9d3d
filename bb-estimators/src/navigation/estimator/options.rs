//! What can be set of the declared filter.

use crate::navigation::eskf::{EskfParams, imu_params};

imu_params! {
    /// Options of [`EskfEstimator`](super::EskfEstimator). The noise is that of a small MEMS IMU.
    pub struct NavigationOptions {
        /// Heading of the link's x axis at the start, from east counter-clockwise.
        heading: f64 = 0.0, in -7.0..=7.0, unit "rad";
        /// How well the heading at the start is known, standard deviation.
        heading_deviation: f64 = 0.1, in 1e-6..=4.0, unit "rad";
        /// Starts in motion, with the course that fixes show for the heading of the link's x axis.
        heading_from_course: bool = false;
        /// Standard deviation of a fix that says nothing about its own, horizontal; vertical it is twice as much.
        gnss_deviation: f64 = 5.0, in 1e-3..=1e4, unit "m";
        /// Standard deviation of a component of an odometry's velocity that says nothing about its own.
        odometry_deviation: f64 = 0.1, in 1e-4..=1e3, unit "m/s";
        /// Standard deviation of the position of a pose that says nothing about its own; of its orientation it is a
        /// tenth, in rad.
        pose_deviation: f64 = 0.5, in 1e-4..=1e3, unit "m";
        /// How many measurements of a sensor in a row the gate refuses before the filter is taken to be wrong, and not the
        /// sensor: the next is then fused, however far it is off. 0: never.
        patience: u32 = 50;
        /// How long the position may be dead-reckoned before the estimate is not to be trusted, if there are fixes or
        /// poses to correct it.
        longest_dead_reckoning: f64 = 30.0, in 0.0..=f64::INFINITY, unit "s";
        /// Standard deviation of the horizontal position beyond which the estimate is not to be trusted.
        largest_deviation: f64 = 100.0, in 1e-3..=f64::INFINITY, unit "m";
    }
}

impl NavigationOptions {
    pub(super) fn params(&self) -> EskfParams {
        EskfParams {
            gyroscope_noise: self.gyroscope_noise,
            accelerometer_noise: self.accelerometer_noise,
            gyroscope_bias_walk: self.gyroscope_bias_walk,
            accelerometer_bias_walk: self.accelerometer_bias_walk,
            gravity: self.gravity,
            ..EskfParams::default()
        }
    }
}
