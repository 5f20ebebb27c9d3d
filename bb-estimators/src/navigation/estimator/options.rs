//! Options of the declared filter.

use crate::navigation::eskf::{EskfParams, GaussMarkov, imu_params};

imu_params! {
    /// Options of [`EskfEstimator`](super::EskfEstimator). The noise is that of a small MEMS IMU.
    pub struct NavigationOptions {
        /// Heading of the link's x axis at the start, from east counter-clockwise.
        heading: f64 = 0.0, in -7.0..=7.0, unit "rad";
        /// Standard deviation of the heading at the start. More than half a radian is an unknown heading, which the filter finds by
        /// itself as soon as the robot moves.
        heading_deviation: f64 = 4.0, in 1e-6..=4.0, unit "rad";
        /// Horizontal standard deviation of a fix without a covariance; the vertical one is twice as large.
        gnss_deviation: f64 = 5.0, in 1e-3..=1e4, unit "m";
        /// Standard deviation of a component of a receiver's velocity without a covariance.
        gnss_velocity_deviation: f64 = 0.2, in 1e-3..=1e3, unit "m/s";
        /// Standard deviation of a receiver's heading without a covariance.
        gnss_heading_deviation: f64 = 0.02, in 1e-4..=4.0, unit "rad";
        /// Standard deviation of the velocity of an odometry along its x axis. A larger one in its covariance counts instead: that of
        /// an encoder knows nothing of slip.
        odometry_deviation: f64 = 0.1, in 1e-4..=1e3, unit "m/s";
        /// Standard deviation of the position of a pose without a covariance; that of its orientation is a tenth of it,
        /// in rad.
        pose_deviation: f64 = 0.5, in 1e-4..=1e3, unit "m";
        /// Standard deviation of the translation of a relative pose without a covariance; that of its rotation is a tenth of
        /// it, in rad.
        relative_deviation: f64 = 0.05, in 1e-5..=1e3, unit "m";
        /// Standard deviation of the sideways velocity of an odometry; that of the vertical one is twice as large.
        sideways_deviation: f64 = 0.1, in 1e-4..=1e3, unit "m/s";
        /// Time over which the errors of an odometry's velocity are alike. 0: each reading has its own.
        odometry_correlation: f64 = 1.0, in 0.0..=1e3, unit "s";
        /// Angle from true north to magnetic north, positive to the east.
        declination: f64 = 0.0, in -7.0..=7.0, unit "rad";
        /// Standard deviation of the heading from the magnetic field.
        magnetic_deviation: f64 = 0.1, in 1e-4..=4.0, unit "rad";
        /// Standard deviation of the height from a pressure without a variance.
        pressure_deviation: f64 = 0.5, in 1e-3..=1e3, unit "m";
        /// Standard deviation of the GNSS antenna's declared position, if its error is a state.
        gnss_lever_arm: f64 = 0.1, in 0.0..=100.0, unit "m";
        /// Standard deviation of the delay of fixes beyond their stamps, if the delay is a state.
        gnss_delay: f64 = 0.1, in 0.0..=10.0, unit "s";
        /// Standard deviation of the scale of the wheels from 1, if the scale is a state.
        wheel_scale: f64 = 0.05, in 0.0..=1.0;
        /// Correlation time of the scale of the wheels.
        wheel_scale_time: f64 = 1000.0, in 1e-3..=f64::INFINITY, unit "s";
        /// Standard deviation of the yaw of the IMU's mounting in the vehicle beyond the declared one, if the mounting is a state. More
        /// than half a radian is an unknown mounting, which the filter finds by itself as soon as the vehicle moves.
        wheel_mounting: f64 = 4.0, in 0.0..=4.0, unit "rad";
        /// Standard deviation of the scale of relative poses from 1, if the scale is a state.
        relative_scale: f64 = 0.02, in 0.0..=1.0;
        /// Correlation time of the scale of relative poses.
        relative_scale_time: f64 = 20.0, in 1e-3..=f64::INFINITY, unit "s";
        /// Standard deviation of the magnetic field of the robot itself, if that field is a state.
        hard_iron: f64 = 5e-6, in 0.0..=1.0, unit "T";
        /// Standard deviation of the error of the barometric height.
        barometer_bias: f64 = 10.0, in 0.0..=1e4, unit "m";
        /// Correlation time of the error of the barometric height.
        barometer_bias_time: f64 = 3600.0, in 1e-3..=f64::INFINITY, unit "s";
        /// Longest dead reckoning of the position before the estimate counts as unreliable, if the robot has a source of fixes or poses.
        longest_dead_reckoning: f64 = 30.0, in 0.0..=f64::INFINITY, unit "s";
        /// Standard deviation of the horizontal position beyond which the estimate counts as unreliable.
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
            gnss_lever_arm: GaussMarkov::constant(self.gnss_lever_arm),
            gnss_delay: GaussMarkov { deviation: self.gnss_delay, ..EskfParams::default().gnss_delay },
            wheel_scale: GaussMarkov::new(self.wheel_scale, self.wheel_scale_time),
            wheel_mounting: GaussMarkov::constant(self.wheel_mounting),
            relative_scale: GaussMarkov::new(self.relative_scale, self.relative_scale_time),
            hard_iron: GaussMarkov { deviation: self.hard_iron, ..EskfParams::default().hard_iron },
            barometer_bias: GaussMarkov::new(self.barometer_bias, self.barometer_bias_time),
            ..EskfParams::default()
        }
    }
}
