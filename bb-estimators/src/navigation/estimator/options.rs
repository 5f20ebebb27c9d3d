//! What can be set of the declared filter.

use crate::navigation::eskf::EskfParams;
use bb_core::Options;

/// Options of [`EskfEstimator`](super::EskfEstimator). The noise is that of a small MEMS IMU.
#[derive(Clone, Copy, Debug, PartialEq, Options)]
pub struct NavigationOptions {
    /// White noise of the gyroscope, rad/s/√Hz. Default: 1.7e-4, 0.01°/s/√Hz.
    #[option(default = 1.7e-4, range = 1e-9..=10.0)]
    pub gyroscope_noise: f64,
    /// White noise of the accelerometer, m/s²/√Hz. Default: 2e-3, 200 µg/√Hz.
    #[option(default = 2e-3, range = 1e-9..=100.0)]
    pub accelerometer_noise: f64,
    /// Random walk of the gyroscope's bias, rad/s²/√Hz. Default: 2e-5.
    #[option(default = 2e-5, range = 0.0..=1.0)]
    pub gyroscope_bias_walk: f64,
    /// Random walk of the accelerometer's bias, m/s³/√Hz. Default: 3e-3.
    #[option(default = 3e-3, range = 0.0..=10.0)]
    pub accelerometer_bias_walk: f64,
    /// Gravity where the robot is, m/s². Default: 9.80665.
    #[option(default = 9.80665, range = 1.0..=30.0)]
    pub gravity: f64,
    /// Heading of the link's x axis at the start, from east counter-clockwise. Unit: rad. Default: 0.
    #[option(default = 0.0, range = -7.0..=7.0, unit = "rad")]
    pub heading: f64,
    /// How well that is known, standard deviation. Unit: rad. Default: 0.1.
    #[option(default = 0.1, range = 1e-6..=4.0, unit = "rad")]
    pub heading_deviation: f64,
    /// Starts in motion, with the course that fixes show for the heading of the link's x axis. Default: false.
    #[option(default = false)]
    pub heading_from_course: bool,
    /// Standard deviation of a fix that says nothing about its own, horizontal; vertical it is twice as much. Unit: m.
    /// Default: 5.
    #[option(default = 5.0, range = 1e-3..=1e4, unit = "m")]
    pub gnss_deviation: f64,
    /// Standard deviation of a component of an odometry's velocity that says nothing about its own. Unit: m/s. Default: 0.1.
    #[option(default = 0.1, range = 1e-4..=1e3, unit = "m/s")]
    pub odometry_deviation: f64,
    /// Standard deviation of the position of a pose that says nothing about its own; of its orientation it is a tenth, in
    /// rad. Unit: m. Default: 0.5.
    #[option(default = 0.5, range = 1e-4..=1e3, unit = "m")]
    pub pose_deviation: f64,
    /// How many measurements of a sensor in a row the gate refuses before the filter is taken to be wrong, and not the sensor:
    /// the next is then fused, however far it is off. 0: never. Default: 50.
    #[option(default = 50)]
    pub patience: u32,
    /// How long the position may be dead-reckoned before the estimate is not to be trusted, if there are fixes or poses to
    /// correct it. Unit: s. Default: 30.
    #[option(default = 30.0, range = 0.0..=f64::INFINITY, unit = "s")]
    pub longest_dead_reckoning: f64,
    /// Standard deviation of the horizontal position beyond which the estimate is not to be trusted. Unit: m. Default: 100.
    #[option(default = 100.0, range = 1e-3..=f64::INFINITY, unit = "m")]
    pub largest_deviation: f64,
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
