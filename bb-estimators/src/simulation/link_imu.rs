//! A simulated IMU on any link of a robot whose joints move.

use super::probe::Probe;
use super::random::{hash, normal};
use bb_core::payload::Imu;
use bb_core::{Fault, MonotonicTime, Options, Reading, Sensor, SensorContext};
use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// A gyroscope and an accelerometer on a link in the [`SimulatedWorld`](super::SimulatedWorld). They measure the angular
/// velocity of the link and its specific force, from position, velocity and acceleration of the joints between it and the root,
/// and of the root itself.
#[derive(Debug)]
pub struct SimulatedLinkImu {
    options: SimulatedLinkImuOptions,
    probe: Probe,
    gyroscope_bias: Vector3<f64>,
    accelerometer_bias: Vector3<f64>,
    random: ChaCha8Rng,
    previous: Option<MonotonicTime>,
}

/// Options of [`SimulatedLinkImu`]. The noise is that of a small MEMS sensor.
#[derive(Clone, Debug, PartialEq, Options)]
pub struct SimulatedLinkImuOptions {
    /// Noise density of the gyroscope, rad/s/√Hz. Default: 1.7e-4.
    #[option(default = 1.7e-4, range = 0.0..=1.0)]
    pub gyroscope_noise: f64,
    /// Standard deviation of the gyroscope's constant bias on each axis. Unit: rad/s. Default: 0.003.
    #[option(default = 3e-3, range = 0.0..=1.0, unit = "rad/s")]
    pub gyroscope_bias: f64,
    /// Noise density of the accelerometer, m/s²/√Hz. Default: 2e-3.
    #[option(default = 2e-3, range = 0.0..=10.0)]
    pub accelerometer_noise: f64,
    /// Standard deviation of the accelerometer's constant bias on each axis. Unit: m/s^2. Default: 0.02.
    #[option(default = 0.02, range = 0.0..=10.0, unit = "m/s^2")]
    pub accelerometer_bias: f64,
    /// Chooses noise and biases. Default: 0.
    #[option(default = 0)]
    pub seed: u64,
}

impl Sensor for SimulatedLinkImu {
    type Options = SimulatedLinkImuOptions;
    type Output = Imu;

    fn init(options: SimulatedLinkImuOptions, context: &SensorContext) -> Result<Self, Fault> {
        let probe = Probe::new(context)?;
        let mut random = ChaCha8Rng::seed_from_u64(options.seed ^ hash(context.path()));
        let gyroscope_bias = options.gyroscope_bias * normal(&mut random);
        let accelerometer_bias = options.accelerometer_bias * normal(&mut random);
        Ok(Self { options, probe, gyroscope_bias, accelerometer_bias, random, previous: None })
    }

    fn read(&mut self, now: MonotonicTime) -> Result<Reading<Imu>, Fault> {
        let (world_from_link, motion) = self.probe.read(now)?;
        // The first sample has no predecessor: its noise is that of a short interval.
        let step_s = self.previous.map_or(5e-3, |previous| now.seconds_since(previous)).max(1e-6);
        self.previous = Some(now);
        let per_root_hz = 1.0 / step_s.sqrt();
        let gyroscope_noise = self.options.gyroscope_noise * per_root_hz * normal(&mut self.random);
        let accelerometer_noise = self.options.accelerometer_noise * per_root_hz * normal(&mut self.random);
        let specific_force = motion.acceleration - world_from_link.rotation.inverse() * self.probe.world.gravity();
        Ok(Reading::now(Imu::new(
            motion.angular_velocity + self.gyroscope_bias + gyroscope_noise,
            specific_force + self.accelerometer_bias + accelerometer_noise,
        )))
    }
}
