//! What the sensors and the optional states are like.

use super::states::Optional;
use crate::attitude::ParamsError;
use crate::attitude::params::accept;

/// The tuning of [`Eskf`](super::Eskf).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EskfParams {
    /// White noise of the gyroscope.
    ///
    /// Small: trusts the gyroscope. Large: the attitude follows the other sensors sooner. From 1e-9 to 10.
    ///
    /// Unit: rad/s/√Hz. Default: 1.7e-4, 0.01°/s/√Hz. Source: data sheets of MEMS gyroscopes, 0.003–0.03°/s/√Hz.
    pub gyroscope_noise: f64,
    /// White noise of the accelerometer.
    ///
    /// Small: trusts the accelerometer. Large: the velocity follows the other sensors sooner. From 1e-9 to 100.
    ///
    /// Unit: m/s²/√Hz. Default: 2e-3, 200 µg/√Hz. Source: data sheets of MEMS accelerometers, 60–300 µg/√Hz.
    pub accelerometer_noise: f64,
    /// Random walk of the gyroscope's bias.
    ///
    /// Small: steady, and slow to follow a bias that changes. Large: the bias takes up errors of the model. From 0 to 1.
    ///
    /// Unit: rad/s²/√Hz. Default: 2e-5. Source: calibration of the ADIS16448 in the EuRoC MAV data sets.
    pub gyroscope_bias_walk: f64,
    /// Random walk of the accelerometer's bias.
    ///
    /// Small: steady, and slow to follow a bias that changes. Large: the bias takes up errors of the model. From 0 to 10.
    ///
    /// Unit: m/s³/√Hz. Default: 3e-3. Source: calibration of the ADIS16448 in the EuRoC MAV data sets.
    pub accelerometer_bias_walk: f64,
    /// Gravity where the robot is.
    ///
    /// An error of it is taken for a bias of the accelerometer while the body is level. From 1 to 30.
    ///
    /// Unit: m/s². Default: 9.80665. Source: standard gravity; it varies by 0.05 m/s² over the earth.
    pub gravity: f64,
    /// The longest time that one sample of the IMU is taken to describe. What is longer is a gap.
    ///
    /// Small: a late sample counts as a gap, and the covariance grows by much. Large: a lost sample is bridged as if
    /// its successor had been measured all the time. From 1e-4 to 1.
    ///
    /// Unit: s. Default: 0.1. Source: ten samples of a slow IMU.
    pub longest_sample: f64,
    /// Acceleration that a gap in the samples of the IMU may hide, as white noise.
    ///
    /// Small: trusts a constant velocity. Large: the velocity is forgotten sooner. From 0 to 1e4.
    ///
    /// Unit: m/s²/√Hz. Default: 3. Source: a body that accelerates by 3 m/s² for about a second.
    pub gap_acceleration: f64,
    /// Angular velocity that a gap in the samples of the IMU may hide, as white noise.
    ///
    /// Small: trusts a constant attitude. Large: the attitude is forgotten sooner. From 0 to 1e3.
    ///
    /// Unit: rad/s/√Hz. Default: 1. Source: a body that turns by 1 rad/s for about a second.
    pub gap_rotation: f64,
    /// How far the scale of relative poses is from 1, [`Optional::RelativeScale`].
    ///
    /// Small: takes the scale as known. Large: relative translations say less about the velocity. From 0 to 1.
    ///
    /// Unit: none. Default: 0.02 for 20 s. Source: drift of monocular visual-inertial odometry, 1–2 %.
    pub relative_scale: GaussMarkov,
    /// How far the GNSS antenna is from where it is said to be, [`Optional::GnssLeverArm`].
    ///
    /// Small: takes the mounting as measured. Large: needs rotation to be found. From 0 to 100.
    ///
    /// Unit: m. Default: 0.1, for ever. Source: a tape measure.
    pub gnss_lever_arm: GaussMarkov,
    /// How late GNSS measurements are, beyond their stamps, [`Optional::GnssDelay`].
    ///
    /// Small: takes the stamps as they are. Large: needs acceleration to be found. From 0 to 10.
    ///
    /// Unit: s. Default: 0.1, for ever. Source: receivers that stamp at the end of a 10 Hz period.
    pub gnss_delay: GaussMarkov,
    /// How far the scale of the wheel speed is from 1, [`Optional::WheelScale`].
    ///
    /// Small: takes the wheel's radius as known. Large: needs another source of speed to be found. From 0 to 1.
    ///
    /// Unit: none. Default: 0.03 for 1000 s. Source: wear and pressure of a tyre.
    pub wheel_scale: GaussMarkov,
    /// Magnetic field of the body itself, [`Optional::HardIron`].
    ///
    /// Small: takes the magnetometer as calibrated. Large: needs rotation to be found. From 0 to 1.
    ///
    /// Unit: T. Default: 5e-6 for 1000 s. Source: a tenth of the earth's field.
    pub hard_iron: GaussMarkov,
    /// How far the barometric height is off, [`Optional::BarometerBias`].
    ///
    /// Small: takes the pressure at the origin as known. Large: needs another source of height. From 0 to 1e4.
    ///
    /// Unit: m. Default: 10 for 3600 s. Source: weather, a hectopascal an hour.
    pub barometer_bias: GaussMarkov,
}

/// White noise of the IMU and of its biases, as densities squared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuDensities {
    /// Of the accelerometer, m²/s³.
    pub accelerometer: f64,
    /// Of the gyroscope, rad²/s.
    pub gyroscope: f64,
    /// Of the random walk of the accelerometer's bias, m²/s⁵.
    pub accelerometer_bias: f64,
    /// Of the random walk of the gyroscope's bias, rad²/s³.
    pub gyroscope_bias: f64,
}

/// A first-order Gauss–Markov process: a state that wanders, but not away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GaussMarkov {
    /// Standard deviation, at the start and in the long run, in the state's unit.
    pub deviation: f64,
    /// Correlation time, s; infinite for a constant. From 1e-3.
    pub time_s: f64,
}

impl GaussMarkov {
    /// A constant that is not known.
    pub const fn constant(deviation: f64) -> Self {
        Self { deviation, time_s: f64::INFINITY }
    }

    /// A state that wanders within `deviation` over `time_s`.
    pub const fn new(deviation: f64, time_s: f64) -> Self {
        Self { deviation, time_s }
    }
}

impl Default for EskfParams {
    fn default() -> Self {
        Self {
            gyroscope_noise: 1.7e-4,
            accelerometer_noise: 2e-3,
            gyroscope_bias_walk: 2e-5,
            accelerometer_bias_walk: 3e-3,
            gravity: 9.80665,
            longest_sample: 0.1,
            gap_acceleration: 3.0,
            gap_rotation: 1.0,
            relative_scale: GaussMarkov::new(0.02, 20.0),
            gnss_lever_arm: GaussMarkov::constant(0.1),
            gnss_delay: GaussMarkov::constant(0.1),
            wheel_scale: GaussMarkov::new(0.03, 1000.0),
            hard_iron: GaussMarkov::new(5e-6, 1000.0),
            barometer_bias: GaussMarkov::new(10.0, 3600.0),
        }
    }
}

impl EskfParams {
    /// The noise of the IMU.
    pub fn densities(&self) -> ImuDensities {
        let square = |x: f64| x * x;
        ImuDensities {
            accelerometer: square(self.accelerometer_noise),
            gyroscope: square(self.gyroscope_noise),
            accelerometer_bias: square(self.accelerometer_bias_walk),
            gyroscope_bias: square(self.gyroscope_bias_walk),
        }
    }

    /// The noise while nothing is measured.
    pub(in crate::navigation) fn gap_densities(&self) -> ImuDensities {
        let square = |x: f64| x * x;
        let densities = self.densities();
        ImuDensities {
            accelerometer: densities.accelerometer + square(self.gap_acceleration),
            gyroscope: densities.gyroscope + square(self.gap_rotation),
            ..densities
        }
    }

    /// The process of an optional state; none for a keyframe, which is what it was.
    pub(in crate::navigation) fn process(&self, state: Optional) -> Option<GaussMarkov> {
        match state {
            Optional::Keyframe => None,
            Optional::RelativeScale => Some(self.relative_scale),
            Optional::GnssLeverArm => Some(self.gnss_lever_arm),
            Optional::GnssDelay => Some(self.gnss_delay),
            Optional::WheelScale => Some(self.wheel_scale),
            Optional::HardIron => Some(self.hard_iron),
            Optional::BarometerBias => Some(self.barometer_bias),
        }
    }

    pub(crate) fn check(&self) -> Result<(), ParamsError> {
        accept("gyroscope_noise", self.gyroscope_noise, (1e-9, 10.0), "rad/s/√Hz")?;
        accept("accelerometer_noise", self.accelerometer_noise, (1e-9, 100.0), "m/s²/√Hz")?;
        accept("gyroscope_bias_walk", self.gyroscope_bias_walk, (0.0, 1.0), "rad/s²/√Hz")?;
        accept("accelerometer_bias_walk", self.accelerometer_bias_walk, (0.0, 10.0), "m/s³/√Hz")?;
        accept("gravity", self.gravity, (1.0, 30.0), "m/s²")?;
        accept("longest_sample", self.longest_sample, (1e-4, 1.0), "s")?;
        accept("gap_acceleration", self.gap_acceleration, (0.0, 1e4), "m/s²/√Hz")?;
        accept("gap_rotation", self.gap_rotation, (0.0, 1e3), "rad/s/√Hz")?;
        self.relative_scale.check("relative_scale", 1.0, "")?;
        self.gnss_lever_arm.check("gnss_lever_arm", 100.0, "m")?;
        self.gnss_delay.check("gnss_delay", 10.0, "s")?;
        self.wheel_scale.check("wheel_scale", 1.0, "")?;
        self.hard_iron.check("hard_iron", 1.0, "T")?;
        self.barometer_bias.check("barometer_bias", 1e4, "m")
    }
}

impl GaussMarkov {
    fn check(&self, parameter: &'static str, max: f64, unit: &'static str) -> Result<(), ParamsError> {
        accept(parameter, self.deviation, (0.0, max), unit)?;
        // Infinite is a constant.
        if self.time_s == f64::INFINITY {
            return Ok(());
        }
        accept(parameter, self.time_s, (1e-3, f64::MAX), "s")
    }
}
