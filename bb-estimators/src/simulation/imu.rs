//! A simulated sensor of nine axes.

use super::Motion;
use super::random::{hash, normal};
use bb_core::payload::{Imu, MagneticField, Marg};
use bb_core::{Fault, MonotonicTime, Options, Reading, Sensor, SensorContext};
use nalgebra::{Isometry3, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// The magnetic field of the simulated world in T: that of central Europe, its horizontal part due north.
const MAGNETIC_FIELD: Vector3<f64> = Vector3::new(0.0, 20e-6, -44e-6);

/// A gyroscope, an accelerometer and a magnetometer on a body that moves by [`Motion`], mounted where the robot
/// declares them: their readings are those of their own frame, lever arm included.
#[derive(Debug)]
pub struct SimulatedImu {
    options: SimulatedImuOptions,
    root_from_frame: Isometry3<f64>,
    bias: Vector3<f64>,
    random: ChaCha8Rng,
    start: Option<MonotonicTime>,
    previous_s: f64,
}

/// Options of [`SimulatedImu`]. The noise is that of a small MEMS sensor.
#[derive(Clone, Copy, Debug, PartialEq, Options)]
pub struct SimulatedImuOptions {
    /// Noise density of the gyroscope, rad/s/√Hz. Default: 1.7e-4.
    #[option(default = 1.7e-4, range = 0.0..=1.0)]
    pub gyroscope_noise: f64,
    /// Standard deviation of the gyroscope's constant bias on each axis. Unit: rad/s. Default: 0.003.
    #[option(default = 3e-3, range = 0.0..=1.0, unit = "rad/s")]
    pub gyroscope_bias: f64,
    /// Noise density of the accelerometer, m/s²/√Hz. Default: 2e-3.
    #[option(default = 2e-3, range = 0.0..=10.0)]
    pub accelerometer_noise: f64,
    /// Standard deviation of a reading of the magnetometer. Unit: T. Default: 0.3 µT.
    #[option(default = 3e-7, range = 0.0..=1e-3, unit = "T")]
    pub magnetometer_noise: f64,
    /// Chooses the noise. Sensors at different paths have different noise with the same seed. Default: 0.
    #[option(default = 0)]
    pub seed: u64,
    /// Time for which the sensor measures; it then has finished. Unit: s. Default: for ever.
    #[option(default = f64::INFINITY, range = 0.0..=f64::INFINITY, unit = "s")]
    pub duration: f64,
}

impl Sensor for SimulatedImu {
    type Options = SimulatedImuOptions;
    type Output = Marg;

    fn init(options: SimulatedImuOptions, context: &SensorContext) -> Result<Self, Fault> {
        let root_from_frame = context.root_from_frame().ok_or_else(|| {
            Fault::new(
                "it is mounted beyond a moving joint, which its motion does not include; use `SimulatedLinkImu`",
            )
        })?;
        let mut random = ChaCha8Rng::seed_from_u64(options.seed ^ hash(context.path()));
        let bias = options.gyroscope_bias * normal(&mut random);
        Ok(Self { options, root_from_frame, bias, random, start: None, previous_s: 0.0 })
    }

    fn read(&mut self, now: MonotonicTime) -> Result<Reading<Marg>, Fault> {
        let start = *self.start.get_or_insert(now);
        let time_s = now.seconds_since(start);
        if time_s > self.options.duration {
            return Ok(Reading::finished());
        }
        // The first sample has no predecessor: its noise and its mean are those of a short interval.
        let step_s = if time_s > self.previous_s { time_s - self.previous_s } else { 5e-3 };
        let angular_velocity = self.bias
            + Motion.mean_angular_velocity(&self.root_from_frame, time_s - step_s, time_s)
            + self.options.gyroscope_noise / step_s.sqrt() * normal(&mut self.random);
        let linear_acceleration = Motion.specific_force(&self.root_from_frame, time_s)
            + self.options.accelerometer_noise / step_s.sqrt() * normal(&mut self.random);
        let frame_from_world = (Motion.world_from_root(time_s) * self.root_from_frame).rotation.inverse();
        let magnetic_field =
            frame_from_world * MAGNETIC_FIELD + self.options.magnetometer_noise * normal(&mut self.random);
        self.previous_s = time_s;
        Ok(Reading::now(Marg {
            imu: Imu::new(angular_velocity, linear_acceleration),
            magnetic_field: Some(MagneticField::new(magnetic_field)),
        }))
    }
}
