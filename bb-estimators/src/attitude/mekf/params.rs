//! The tuning of the Kalman filter: what the sensors are like.

use crate::attitude::ParamsError;
use crate::attitude::params::accept;

/// The tuning of [`MekfFilter`](super::MekfFilter).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "runtime", derive(bb_core::Options))]
pub struct MekfParams {
    /// White noise of the gyroscope, per root of the bandwidth.
    ///
    /// Small: trusts the gyroscope. Large: follows accelerometer and magnetometer sooner. From 0 to 1.
    ///
    /// Unit: rad/s/√Hz. Default: 1.7e-4, 0.01°/s/√Hz. Source: data sheets of MEMS gyroscopes, 0.003–0.03°/s/√Hz.
    #[cfg_attr(feature = "runtime", option(default = Self::default().gyroscope_noise, range = 0.0..=1.0))]
    pub gyroscope_noise: f64,
    /// What the gyroscope's error grows by with the angular velocity, beyond scale and misalignment:
    /// nonlinearity, its sensitivity to acceleration, and the sampling of a rate that changes.
    ///
    /// Small: trusts the calibration that it finds, which then has to be constant. Large: fast rotation is
    /// forgotten like noise. From 0 to 1.
    ///
    /// Unit: √s (rad/√s per rad/s). Default: 9e-4. Source: data sheets give a nonlinearity of 0.1 %, here of
    /// motion that changes about once a second.
    #[cfg_attr(feature = "runtime", option(default = Self::default().gyroscope_rate_noise, range = 0.0..=1.0))]
    pub gyroscope_rate_noise: f64,
    /// Standard deviation of the gyroscope's bias at the start.
    ///
    /// Small: a larger bias is found late. Large: an acceleration at the start is taken for one. From 0 to 1.
    ///
    /// Unit: rad/s. Default: 0.0175, 1°/s. Source: data sheets; VQF's `biasSigmaInit` is 0.5°/s.
    #[cfg_attr(feature = "runtime", option(default = Self::default().initial_bias, range = 0.0..=1.0, unit = "rad/s"))]
    pub initial_bias: f64,
    /// How fast the bias wanders: its standard deviation after a second.
    ///
    /// Small: steady, and slow to follow a bias that changes. Large: accelerations are taken for bias. From 0
    /// to 1.
    ///
    /// Unit: rad/s/√s. Default: 1.4e-4, 0.08°/s after 100 s. Source: VQF's `biasForgettingTime`, 0.1°/s in 100 s.
    #[cfg_attr(feature = "runtime", option(default = Self::default().bias_drift, range = 0.0..=1.0))]
    pub bias_drift: f64,
    /// Standard deviation of the gyroscope's scale errors, and of its misalignment in rad.
    ///
    /// 0: takes the gyroscope as calibrated, and its scale error tilts fast rotation. Large: accelerations are
    /// taken for scale errors. From 0 to 0.5.
    ///
    /// Unit: none. Default: 0.004. Source: factory calibration of MEMS gyroscopes, 0.1–1 %.
    #[cfg_attr(feature = "runtime", option(default = Self::default().calibration_error, range = 0.0..=0.5))]
    pub calibration_error: f64,
    /// The velocity of slow motion, horizontally. It stays bounded, so accelerations have no mean.
    ///
    /// Small: tilt follows the accelerometer soon, and accelerations with it. Large: tilt follows the gyroscope
    /// for long. From 0.001 to 1000.
    ///
    /// Unit: m/s. Default: 0.2. Source: a hand that moves slowly.
    #[cfg_attr(feature = "runtime", option(default = Self::default().velocity, range = 1e-3..=1e3, unit = "m/s"))]
    pub velocity: f64,
    /// What the velocity grows by with the acceleration seen of late: velocity over acceleration, how long one
    /// acceleration lasts.
    ///
    /// Small: the same trust in the accelerometer however fast the motion. Large: in fast motion tilt is the
    /// gyroscope's. From 0 to 100.
    ///
    /// Unit: s. Default: 0.1. Source: motion by hand at 1 to 2 Hz.
    #[cfg_attr(feature = "runtime", option(default = Self::default().acceleration_time, range = 0.0..=100.0, unit = "s"))]
    pub acceleration_time: f64,
    /// How much the accelerometer may lag the gyroscope, standard deviation. The lag is estimated; it may be
    /// negative.
    ///
    /// 0: takes them as simultaneous. Large: accelerations are taken for a lag. From 0 to 1.
    ///
    /// Unit: s. Default: 0.001. Source: the two low-pass filters of one chip differ by a millisecond or two.
    #[cfg_attr(feature = "runtime", option(default = Self::default().accelerometer_latency, range = 0.0..=1.0, unit = "s"))]
    pub accelerometer_latency: f64,
    /// Whether a specific force is the mean over the time since the last sample, as the angular velocity is, or
    /// the value at its stamp.
    ///
    /// The wrong one of the two is an error of half a sample's rotation in the tilt of fast motion, of which the
    /// estimated lag takes what it can.
    ///
    /// Unit: none. Default: on. Source: sensors sample fast and give out means, or low-pass to that effect.
    #[cfg_attr(feature = "runtime", option(default = Self::default().force_is_mean))]
    pub force_is_mean: bool,
    /// How much the magnetometer may lag the gyroscope, standard deviation. The lag is estimated.
    ///
    /// 0: takes them as simultaneous, and fast rotation turns the heading. Large: found sooner, less sure. From
    /// 0 to 1.
    ///
    /// Unit: s. Default: 0.01. Source: a magnetometer's period at 100 Hz.
    #[cfg_attr(feature = "runtime", option(default = Self::default().magnetometer_latency, range = 0.0..=1.0, unit = "s"))]
    pub magnetometer_latency: f64,
    /// The field's disturbance where it seems undisturbed, as a fraction of its norm.
    ///
    /// Small: heading follows the field soon, disturbed or not. Large: heading is the gyroscope's for long.
    /// From 1e-4 to 100.
    ///
    /// Unit: none. Default: 0.1. Source: VQF's `magNormTh`, below which a field counts as undisturbed.
    #[cfg_attr(feature = "runtime", option(default = Self::default().field_disturbance, range = 1e-4..=100.0))]
    pub field_disturbance: f64,
    /// Whether the magnetic field corrects the heading.
    ///
    /// Off: magnetic samples are ignored and the heading drifts with what is left of the gyroscope's bias. On:
    /// heading is the magnetic one.
    ///
    /// Unit: none. Default: on. Source: six or nine axes, as in the literature.
    #[cfg_attr(feature = "runtime", option(default = Self::default().magnetometer))]
    pub magnetometer: bool,
}

impl Default for MekfParams {
    fn default() -> Self {
        Self {
            gyroscope_noise: 1.7e-4,
            gyroscope_rate_noise: 9e-4,
            initial_bias: 0.0175,
            bias_drift: 1.4e-4,
            calibration_error: 0.004,
            velocity: 0.2,
            acceleration_time: 0.1,
            accelerometer_latency: 1e-3,
            force_is_mean: true,
            magnetometer_latency: 0.01,
            field_disturbance: 0.1,
            magnetometer: true,
        }
    }
}

impl MekfParams {
    pub(super) fn check(&self) -> Result<(), ParamsError> {
        accept("gyroscope_noise", self.gyroscope_noise, (0.0, 1.0), "rad/s/√Hz")?;
        accept("gyroscope_rate_noise", self.gyroscope_rate_noise, (0.0, 1.0), "√s")?;
        accept("initial_bias", self.initial_bias, (0.0, 1.0), "rad/s")?;
        accept("bias_drift", self.bias_drift, (0.0, 1.0), "rad/s/√s")?;
        accept("calibration_error", self.calibration_error, (0.0, 0.5), "")?;
        accept("velocity", self.velocity, (1e-3, 1e3), "m/s")?;
        accept("acceleration_time", self.acceleration_time, (0.0, 100.0), "s")?;
        accept("accelerometer_latency", self.accelerometer_latency, (0.0, 1.0), "s")?;
        accept("magnetometer_latency", self.magnetometer_latency, (0.0, 1.0), "s")?;
        accept("field_disturbance", self.field_disturbance, (1e-4, 100.0), "")
    }
}
