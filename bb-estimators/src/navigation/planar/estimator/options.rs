//! Options of the declared filter.

use crate::navigation::eskf::GaussMarkov;
use crate::navigation::planar::params::PlanarParams;
use crate::params::params;

params! {
    /// Options of [`PlanarEstimator`](super::PlanarEstimator). The noise is that of a small MEMS gyroscope.
    pub struct PlanarOptions {
        /// White noise of the gyroscope.
        gyroscope_noise: f64 = 1.7e-4, in 1e-9..=10.0, shown "0.01°/s/√Hz", plain "rad/s/√Hz";
        /// Random walk of the gyroscope's bias.
        gyroscope_bias_walk: f64 = 2e-5, in 0.0..=1.0, plain "rad/s²/√Hz";
        /// Acceleration along the body's x axis, as white noise.
        forward_acceleration: f64 = 1.0, in 1e-6..=1e4, plain "m/s²/√Hz";
        /// Acceleration along the body's y axis, as white noise.
        lateral_acceleration: f64 = 0.3, in 1e-6..=1e4, plain "m/s²/√Hz";
        /// How far the scale of the wheels is from 1, standard deviation; 0 where it is known.
        wheel_scale: f64 = 0.02, in 0.0..=1.0;
        /// How long the scale of the wheels stays the same.
        wheel_scale_time: f64 = 1000.0, in 1e-3..=f64::INFINITY, unit "s";
        /// Takes the sideways velocity from the odometry, of a robot that can drive sideways. Otherwise it is zero, whatever the
        /// odometry says.
        omnidirectional: bool = false;
        /// Standard deviation of the sideways velocity of a robot that cannot drive sideways.
        sideways_deviation: f64 = 0.05, in 1e-4..=1e3, unit "m/s";
        /// Heading of the link's x axis at the start, from east counter-clockwise.
        heading: f64 = 0.0, in -7.0..=7.0, unit "rad";
        /// How well the heading at the start is known, standard deviation.
        heading_deviation: f64 = 0.1, in 1e-6..=4.0, unit "rad";
        /// Starts in motion, with the course that fixes show for the heading of the body's x axis.
        heading_from_course: bool = false;
        /// Standard deviation of a fix that says nothing about its own, horizontal.
        gnss_deviation: f64 = 5.0, in 1e-3..=1e4, unit "m";
        /// Standard deviation of a component of an odometry's velocity that says nothing about its own.
        odometry_deviation: f64 = 0.1, in 1e-4..=1e3, unit "m/s";
        /// Standard deviation of an odometry's yaw rate that says nothing about its own.
        yaw_rate_deviation: f64 = 0.05, in 1e-5..=1e3, unit "rad/s";
        /// Standard deviation of the position of a pose that says nothing about its own; of its heading it is a tenth, in rad.
        pose_deviation: f64 = 0.5, in 1e-4..=1e3, unit "m";
        /// Standard deviation of the heading of an orientation that says nothing about its own.
        orientation_deviation: f64 = 0.1, in 1e-5..=4.0, unit "rad";
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

impl PlanarOptions {
    pub(super) fn params(&self) -> PlanarParams {
        PlanarParams {
            gyroscope_noise: self.gyroscope_noise,
            gyroscope_bias_walk: self.gyroscope_bias_walk,
            forward_acceleration: self.forward_acceleration,
            lateral_acceleration: self.lateral_acceleration,
            wheel_scale: GaussMarkov::new(self.wheel_scale, self.wheel_scale_time),
            ..PlanarParams::default()
        }
    }
}
