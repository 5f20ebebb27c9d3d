//! The tuning of the Kalman filter: what the sensors are like.

use crate::params::params;

params! {
    /// The tuning of [`MekfFilter`](super::MekfFilter).
    pub struct MekfParams {
        /// White noise of the gyroscope, per root of the bandwidth.
        ///
        /// Small: trusts the gyroscope. Large: follows accelerometer and magnetometer sooner.
        ///
        /// Source: data sheets of MEMS gyroscopes, 0.003–0.03°/s/√Hz.
        gyroscope_noise: f64 = 1.7e-4, in 0.0..=1.0, shown "0.01°/s/√Hz", plain "rad/s/√Hz";
        /// Growth of the gyroscope's error with the angular velocity, beyond scale and misalignment: nonlinearity,
        /// sensitivity to acceleration, and the sampling of a changing rate.
        ///
        /// Small: trusts the calibration that it finds, which must then be constant. Large: fast rotation is forgotten
        /// like noise.
        ///
        /// Source: data sheets give a nonlinearity of 0.1 %, here of motion that changes about once a second.
        gyroscope_rate_noise: f64 = 9e-4, in 0.0..=1.0, plain "√s";
        /// Standard deviation of the gyroscope's bias at the start.
        ///
        /// Small: a larger bias is found late. Large: an acceleration at the start is mistaken for one.
        ///
        /// Source: data sheets; VQF's `biasSigmaInit` is 0.5°/s.
        initial_bias: f64 = 0.0175, in 0.0..=1.0, shown "1°/s", unit "rad/s";
        /// How fast the bias wanders: its standard deviation after a second.
        ///
        /// Small: steady, and slow to follow a bias that changes. Large: accelerations are mistaken for bias.
        ///
        /// Source: VQF's `biasForgettingTime`, 0.1°/s in 100 s.
        bias_drift: f64 = 1.4e-4, in 0.0..=1.0, shown "0.08°/s after 100 s", plain "rad/s/√s";
        /// Standard deviation of the gyroscope's scale errors, and of its misalignment in rad.
        ///
        /// 0: takes the gyroscope as calibrated, and its scale error tilts fast rotation. Large: accelerations are taken
        /// for scale errors.
        ///
        /// Source: factory calibration of MEMS gyroscopes, 0.1–1 %.
        calibration_error: f64 = 0.004, in 0.0..=0.5;
        /// Horizontal velocity in slow motion. It is bounded, so accelerations average to zero.
        ///
        /// Small: tilt follows the accelerometer soon, and accelerations with it. Large: tilt follows the gyroscope for
        /// long.
        ///
        /// Source: a hand that moves slowly.
        velocity: f64 = 0.2, in 1e-3..=1e3, unit "m/s";
        /// Growth of that velocity with recent acceleration: velocity over acceleration, the duration of one
        /// acceleration.
        ///
        /// Small: the same trust in the accelerometer however fast the motion. Large: in fast motion tilt is the
        /// gyroscope's.
        ///
        /// Source: motion by hand at 1 to 2 Hz.
        acceleration_time: f64 = 0.1, in 0.0..=100.0, unit "s";
        /// Lag of the accelerometer behind the gyroscope, standard deviation. The lag is estimated and may be
        /// negative.
        ///
        /// 0: takes them as simultaneous. Large: accelerations are mistaken for a lag.
        ///
        /// Source: the two low-pass filters of one chip differ by a millisecond or two.
        accelerometer_latency: f64 = 1e-3, in 0.0..=1.0, unit "s";
        /// Whether a specific force is the mean over the time since the last sample, as the angular velocity is, or the
        /// value at its stamp.
        ///
        /// The wrong one of the two is an error of half a sample's rotation in the tilt of fast motion, of which the
        /// estimated lag takes what it can.
        ///
        /// Source: sensors sample fast and give out means, or low-pass to that effect.
        force_is_mean: bool = true;
        /// Lag of the magnetometer behind the gyroscope, standard deviation. The lag is estimated.
        ///
        /// 0: takes them as simultaneous, and fast rotation turns the heading. Large: found sooner, less sure.
        ///
        /// Source: a magnetometer's period at 100 Hz.
        magnetometer_latency: f64 = 0.01, in 0.0..=1.0, unit "s";
        /// Remaining disturbance of a field that seems undisturbed, as a fraction of its norm.
        ///
        /// Small: heading follows the field soon, disturbed or not. Large: heading is the gyroscope's for long.
        ///
        /// Source: VQF's `magNormTh`, below which a field counts as undisturbed.
        field_disturbance: f64 = 0.1, in 1e-4..=100.0;
        /// Whether the magnetic field corrects the heading.
        ///
        /// Off: magnetic samples are ignored and the heading drifts with what is left of the gyroscope's bias. On:
        /// heading is the magnetic one.
        ///
        /// Source: six or nine axes, as in the literature.
        magnetometer: bool = true;
    }
}
