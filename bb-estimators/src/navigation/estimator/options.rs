//! Options of the declared filter.

use crate::navigation::eskf::{EskfParams, GaussMarkov, imu_params};

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
        /// Standard deviation of the way of a relative pose that says nothing about its own; of its rotation it is a tenth, in
        /// rad.
        relative_deviation: f64 = 0.05, in 1e-5..=1e3, unit "m";
        /// Standard deviation of the sideways and vertical velocity of wheels whose scale is estimated.
        sideways_deviation: f64 = 0.05, in 1e-4..=1e3, unit "m/s";
        /// Magnetic north from true north, east positive.
        declination: f64 = 0.0, in -7.0..=7.0, unit "rad";
        /// Standard deviation of the heading of a magnetic field.
        magnetic_deviation: f64 = 0.1, in 1e-4..=4.0, unit "rad";
        /// Standard deviation of the height of a pressure that says nothing about its own.
        pressure_deviation: f64 = 0.5, in 1e-3..=1e3, unit "m";
        /// How far the GNSS antenna is from where it is declared, if that is a state.
        gnss_lever_arm: f64 = 0.1, in 0.0..=100.0, unit "m";
        /// How late fixes are beyond their stamps, if that is a state.
        gnss_delay: f64 = 0.1, in 0.0..=10.0, unit "s";
        /// How far the scale of the wheels is from 1, if that is a state.
        wheel_scale: f64 = 0.02, in 0.0..=1.0;
        /// How long the scale of the wheels stays the same.
        wheel_scale_time: f64 = 1000.0, in 1e-3..=f64::INFINITY, unit "s";
        /// How far the scale of relative poses is from 1, if that is a state.
        relative_scale: f64 = 0.02, in 0.0..=1.0;
        /// How long the scale of relative poses stays the same.
        relative_scale_time: f64 = 20.0, in 1e-3..=f64::INFINITY, unit "s";
        /// Magnetic field of the robot itself, if that is a state.
        hard_iron: f64 = 5e-6, in 0.0..=1.0, unit "T";
        /// How far the barometric height wanders.
        barometer_bias: f64 = 10.0, in 0.0..=1e4, unit "m";
        /// How long the barometric height stays the same.
        barometer_bias_time: f64 = 3600.0, in 1e-3..=f64::INFINITY, unit "s";
        /// Acceleration that a gap in the samples of the IMU may hide, as white noise.
        gap_acceleration: f64 = 3.0, in 0.0..=1e4, plain "m/s²/√Hz";
        /// Angular velocity that a gap in the samples of the IMU may hide, as white noise.
        gap_rotation: f64 = 1.0, in 0.0..=1e3, plain "rad/s/√Hz";
        /// How many measurements of a sensor in a row the gate refuses before the filter is taken to be wrong, and not the
        /// sensor: the next is then fused, with the covariance raised to fit it. Fixes and poses that agree among each other move
        /// the filter to where they are instead, and fewer do if it rests on fewer yet. 0: never.
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
            gap_acceleration: self.gap_acceleration,
            gap_rotation: self.gap_rotation,
            gnss_lever_arm: GaussMarkov::constant(self.gnss_lever_arm),
            gnss_delay: GaussMarkov::constant(self.gnss_delay),
            wheel_scale: GaussMarkov::new(self.wheel_scale, self.wheel_scale_time),
            relative_scale: GaussMarkov::new(self.relative_scale, self.relative_scale_time),
            hard_iron: GaussMarkov { deviation: self.hard_iron, ..EskfParams::default().hard_iron },
            barometer_bias: GaussMarkov::new(self.barometer_bias, self.barometer_bias_time),
            ..EskfParams::default()
        }
    }
}
