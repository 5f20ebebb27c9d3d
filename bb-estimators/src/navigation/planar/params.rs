//! Parameters of the sensors and the robot.

use crate::navigation::eskf::GaussMarkov;
use crate::params::params;

params! {
    /// The tuning of [`PlanarFilter`](super::PlanarFilter).
    pub struct PlanarParams {
        /// White noise of the gyroscope.
        ///
        /// Small: trusts the gyroscope. Large: the heading follows the other sensors sooner.
        ///
        /// Source: data sheets of MEMS gyroscopes, 0.003–0.03°/s/√Hz.
        gyroscope_noise: f64 = 1.7e-4, in 1e-9..=10.0, shown "0.01°/s/√Hz", plain "rad/s/√Hz";
        /// Random walk of the gyroscope's bias.
        ///
        /// Small: steady, and slow to follow a bias that changes. Large: the bias takes up errors of the model.
        ///
        /// Source: calibration of the ADIS16448 in the EuRoC MAV data sets.
        gyroscope_bias_walk: f64 = 2e-5, in 0.0..=1.0, plain "rad/s²/√Hz";
        /// Acceleration along the body's x axis, as white noise.
        ///
        /// Small: smooths the wheels. Large: the velocity follows the latest reading of the wheels.
        ///
        /// Source: a rover that changes its speed by 1 m/s within a second.
        forward_acceleration: f64 = 1.0, in 1e-6..=1e4, plain "m/s²/√Hz";
        /// Acceleration along the body's y axis, as white noise.
        ///
        /// Small: assumes that the robot does not slide. Large: attributes a slide to the velocity instead of the position.
        ///
        /// Source: wheels that are turned slightly while they roll.
        lateral_acceleration: f64 = 0.3, in 1e-6..=1e4, plain "m/s²/√Hz";
        /// Deviation of the scale of the wheels from 1.
        ///
        /// Small: trusts the wheel's radius. Large: without fixes the distance becomes uncertain sooner.
        ///
        /// Source: wear and pressure of a tyre.
        wheel_scale: GaussMarkov = GaussMarkov::new(0.02, 1000.0), deviation 0.0..=1.0, shown "0.02 for 1000 s";
        /// The longest interval that one sample of the gyroscope covers; a longer one is a gap.
        ///
        /// Small: a late sample counts as a gap, and the covariance grows by much. Large: a lost sample is bridged as if
        /// its successor had been measured all the time.
        ///
        /// Source: ten samples of a slow IMU.
        longest_sample: f64 = 0.1, in 1e-4..=1.0, unit "s";
    }
}

/// White noise, as densities squared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Densities {
    /// Noise of the gyroscope, rad²/s.
    pub(super) gyroscope: f64,
    /// Noise of the random walk of its bias, rad²/s³.
    pub(super) bias: f64,
    /// Noise of the acceleration forward and to the left, m²/s³.
    pub(super) acceleration: [f64; 2],
}

impl PlanarParams {
    pub(super) fn densities(&self) -> Densities {
        let square = |x: f64| x * x;
        Densities {
            gyroscope: square(self.gyroscope_noise),
            bias: square(self.gyroscope_bias_walk),
            acceleration: [square(self.forward_acceleration), square(self.lateral_acceleration)],
        }
    }
}
