//! Parameters of the sensors and of the optional states.

use crate::navigation::state::Optional;
use crate::params::{Field, Kind, Value};

/// Adds the parameters of the IMU and of gravity, which the filter and the estimator share, to a parameter struct.
macro_rules! imu_params {
    ($(#[$meta:meta])* pub struct $name:ident { $($rest:tt)* }) => {
        $crate::params::params! {
            $(#[$meta])*
            pub struct $name {
                /// White noise of the gyroscope.
                ///
                /// Small: trusts the gyroscope. Large: the attitude follows the other sensors sooner.
                ///
                /// Source: data sheets of MEMS gyroscopes, 0.003–0.03°/s/√Hz.
                gyroscope_noise: f64 = 1.7e-4, in 1e-9..=10.0, shown "0.01°/s/√Hz", plain "rad/s/√Hz";
                /// White noise of the accelerometer.
                ///
                /// Small: trusts the accelerometer. Large: the velocity follows the other sensors sooner.
                ///
                /// Source: data sheets of MEMS accelerometers, 60–300 µg/√Hz.
                accelerometer_noise: f64 = 2e-3, in 1e-9..=100.0, shown "200 µg/√Hz", plain "m/s²/√Hz";
                /// Random walk of the gyroscope's bias.
                ///
                /// Small: steady, and slow to follow a bias that changes. Large: the bias takes up errors of the model.
                ///
                /// Source: calibration of the ADIS16448 in the EuRoC MAV data sets.
                gyroscope_bias_walk: f64 = 2e-5, in 0.0..=1.0, plain "rad/s²/√Hz";
                /// Random walk of the accelerometer's bias.
                ///
                /// Small: steady, and slow to follow a bias that changes. Large: the bias takes up errors of the model.
                ///
                /// Source: calibration of the ADIS16448 in the EuRoC MAV data sets.
                accelerometer_bias_walk: f64 = 3e-3, in 0.0..=10.0, plain "m/s³/√Hz";
                /// Gravity where the robot is.
                ///
                /// An error of it is taken for a bias of the accelerometer while the body is level.
                ///
                /// Source: standard gravity; it varies by 0.05 m/s² over the earth.
                gravity: f64 = 9.80665, in 1.0..=30.0, unit "m/s^2";
                $($rest)*
            }
        }
    };
}

pub(crate) use imu_params;

imu_params! {
    /// The tuning of [`EskfFilter`](super::EskfFilter).
    pub struct EskfParams {
        /// The longest interval that one sample of the IMU covers; a longer one is a gap.
        ///
        /// Small: a late sample counts as a gap, and the covariance grows by much. Large: a lost sample is bridged as if
        /// its successor had been measured all the time.
        ///
        /// Source: ten samples of a slow IMU.
        longest_sample: f64 = 0.1, in 1e-4..=1.0, unit "s";
        /// Deviation of the scale of relative poses from 1, [`Optional::RelativeScale`].
        ///
        /// Small: trusts the scale. Large: relative translations contribute less to the velocity.
        ///
        /// Source: drift of monocular visual-inertial odometry, 1–2 %.
        relative_scale: GaussMarkov = GaussMarkov::new(0.02, 20.0), deviation 0.0..=1.0, shown "0.02 for 20 s";
        /// Error of the GNSS antenna's declared position, [`Optional::GnssLeverArm`].
        ///
        /// Small: trusts the declared position. Large: needs rotation to become observable.
        ///
        /// Source: a tape measure.
        gnss_lever_arm: GaussMarkov = GaussMarkov::constant(0.1), deviation 0.0..=100.0, shown "0.1 for ever", of "m";
        /// Delay of GNSS measurements beyond their stamps, [`Optional::GnssDelay`].
        ///
        /// Small: trusts the stamps. Large: needs acceleration to become observable.
        ///
        /// Source: receivers whose fixes are 50 to 250 ms old, which wander by a millisecond in a second.
        gnss_delay: GaussMarkov = GaussMarkov::new(0.1, 20_000.0), deviation 0.0..=10.0, shown "0.1 for 20,000 s", of "s";
        /// Deviation of the scale of the wheel speed from 1, [`Optional::WheelScale`].
        ///
        /// Small: trusts the wheel's radius. Large: needs another source of speed to become observable.
        ///
        /// Source: wear and pressure of a tyre.
        wheel_scale: GaussMarkov = GaussMarkov::new(0.03, 1000.0), deviation 0.0..=1.0, shown "0.03 for 1000 s";
        /// Yaw and pitch of the IMU's mounting in the vehicle beyond the declared ones, [`Optional::WheelMounting`].
        ///
        /// Small: trusts the mounting. Large: needs a vehicle that moves to become observable.
        ///
        /// Source: an IMU aligned with the vehicle by eye.
        wheel_mounting: GaussMarkov = GaussMarkov::constant(0.09), deviation 0.0..=7.0, shown "5° for ever", of "rad";
        /// Magnetic field of the body itself, [`Optional::HardIron`].
        ///
        /// Small: trusts the calibration of the magnetometer. Large: needs rotation to become observable.
        ///
        /// Source: a tenth of the earth's field.
        hard_iron: GaussMarkov = GaussMarkov::new(5e-6, 1000.0), deviation 0.0..=1.0, shown "5e-6 for 1000 s", of "T";
        /// Error of the barometric height, [`Optional::BarometerBias`].
        ///
        /// Small: trusts the pressure at the origin. Large: needs another source of height.
        ///
        /// Source: weather, a hectopascal an hour.
        barometer_bias: GaussMarkov = GaussMarkov::new(10.0, 3600.0), deviation 0.0..=1e4, shown "10 for 3600 s", of "m";
    }
}

/// White noise of the IMU and of its biases, as densities squared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuDensities {
    /// Noise of the accelerometer, m²/s³.
    pub accelerometer: f64,
    /// Noise of the gyroscope, rad²/s.
    pub gyroscope: f64,
    /// Noise of the random walk of the accelerometer's bias, m²/s⁵.
    pub accelerometer_bias: f64,
    /// Noise of the random walk of the gyroscope's bias, rad²/s³.
    pub gyroscope_bias: f64,
}

impl ImuDensities {
    /// The densities with the white noise of the IMU, as a deviation, multiplied. The walks of its biases stay: a multiple of them, found on
    /// noise, made the biases follow every error of the model.
    pub(in crate::navigation) fn times(self, multiple: f64) -> Self {
        let factor = multiple * multiple;
        Self { accelerometer: self.accelerometer * factor, gyroscope: self.gyroscope * factor, ..self }
    }
}

/// A first-order Gauss–Markov process: a state that varies but stays bounded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GaussMarkov {
    /// Standard deviation, at the start and in the long run, in the state's unit.
    pub deviation: f64,
    /// Correlation time, s; infinite for a constant. From 1e-3.
    pub time_s: f64,
}

impl GaussMarkov {
    /// An unknown constant.
    pub const fn constant(deviation: f64) -> Self {
        Self { deviation, time_s: f64::INFINITY }
    }

    /// A state that varies within `deviation` over `time_s`.
    pub const fn new(deviation: f64, time_s: f64) -> Self {
        Self { deviation, time_s }
    }
}

impl Field for GaussMarkov {
    const KIND: Kind = Kind::Process;

    fn to_value(self) -> Value {
        Value::Process { deviation: self.deviation, time_s: self.time_s }
    }

    fn from_value(value: Value) -> Option<Self> {
        match value {
            Value::Process { deviation, time_s } => Some(Self { deviation, time_s }),
            _ => None,
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

    /// The process of an optional state; `None` for a keyframe, which does not change.
    pub(in crate::navigation) fn process(&self, state: Optional) -> Option<GaussMarkov> {
        match state {
            Optional::Keyframe => None,
            Optional::RelativeScale => Some(self.relative_scale),
            Optional::GnssLeverArm => Some(self.gnss_lever_arm),
            Optional::GnssDelay => Some(self.gnss_delay),
            Optional::WheelScale => Some(self.wheel_scale),
            Optional::WheelMounting => Some(self.wheel_mounting),
            Optional::HardIron => Some(self.hard_iron),
            Optional::BarometerBias => Some(self.barometer_bias),
        }
    }

    /// The initial variance of a component of an optional state.
    pub(in crate::navigation) fn variance(&self, state: Optional) -> f64 {
        let variance = self.process(state).map_or(1.0, |process| process.deviation * process.deviation);
        // A variance of 0 would make the matrix singular; this value still amounts to a known state.
        variance.max(1e-24)
    }
}
