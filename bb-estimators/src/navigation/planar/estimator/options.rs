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
        /// Standard deviation of the scale of the wheels from 1; 0 if the scale is known.
        wheel_scale: f64 = 0.02, in 0.0..=1.0;
        /// Correlation time of the scale of the wheels.
        wheel_scale_time: f64 = 1000.0, in 1e-3..=f64::INFINITY, unit "s";
        /// Use of the sideways velocity from the odometry, for a robot that can drive sideways. Otherwise the sideways velocity is assumed
        /// to be zero.
        omnidirectional: bool = false;
        /// Standard deviation of the sideways velocity of a robot that cannot drive sideways.
        sideways_deviation: f64 = 0.05, in 1e-4..=1e3, unit "m/s";
        /// Heading of the link's x axis at the start, from east counter-clockwise.
        heading: f64 = 0.0, in -7.0..=7.0, unit "rad";
        /// Standard deviation of the heading at the start. More than half a radian is an unknown heading, which the filter finds by
        /// itself as soon as the robot moves.
        heading_deviation: f64 = 4.0, in 1e-6..=4.0, unit "rad";
        /// Horizontal standard deviation of a fix without a covariance.
        gnss_deviation: f64 = 5.0, in 1e-3..=1e4, unit "m";
        /// Standard deviation of each component of the velocity of an odometry. A larger one in its covariance counts instead: that of
        /// an encoder knows nothing of slip.
        odometry_deviation: f64 = 0.1, in 1e-4..=1e3, unit "m/s";
        /// Standard deviation of the yaw rate of an odometry. A larger one in its covariance counts instead.
        yaw_rate_deviation: f64 = 0.05, in 1e-5..=1e3, unit "rad/s";
        /// Time over which the errors of an odometry are alike. 0: each reading has its own.
        odometry_correlation: f64 = 1.0, in 0.0..=1e3, unit "s";
        /// Standard deviation of the position of a pose without a covariance; that of its heading is a tenth of it, in rad.
        pose_deviation: f64 = 0.5, in 1e-4..=1e3, unit "m";
        /// Standard deviation of the heading of an orientation without a covariance.
        orientation_deviation: f64 = 0.1, in 1e-5..=4.0, unit "rad";
        /// Longest dead reckoning of the position before the estimate counts as unreliable, if the robot has a source of fixes or poses.
        longest_dead_reckoning: f64 = 30.0, in 0.0..=f64::INFINITY, unit "s";
        /// Standard deviation of the horizontal position beyond which the estimate counts as unreliable.
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
