//! A simulated IMU on any link of a robot whose joints move.

use super::random::{hash, normal};
use super::{GRAVITY, SimulatedWorld};
use bb_core::kinematics::{Frames, Kinematics, LinkId};
use bb_core::payload::Imu;
use bb_core::{Fault, MonotonicTime, Options, Reading, Sensor, SensorContext};
use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use std::fmt;
use std::ops::Range;
use std::sync::Arc;

/// A gyroscope and an accelerometer on a link in the [`SimulatedWorld`]. They measure the angular velocity of the
/// link and its specific force, from position, velocity and acceleration of the joints between it and the root, which
/// is at rest with its z axis up.
pub struct SimulatedLinkImu {
    options: SimulatedLinkImuOptions,
    path: &'static str,
    world: Arc<SimulatedWorld>,
    frames: Frames,
    link: LinkId,
    /// The joint of the topology for each coordinate.
    coordinates: Vec<(usize, Range<usize>, Range<usize>)>,
    positions: Vec<f64>,
    velocities: Vec<f64>,
    accelerations: Vec<f64>,
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
        let topology = context.topology();
        let world = context.shared(|| SimulatedWorld::new(topology));
        world.check_plugged(context.path())?;
        let kinematics = Kinematics::new(topology)?;
        let link = kinematics.link(context.frame().name());
        let link = link.ok_or_else(|| Fault::permanent("it is mounted on a link; declare it in one"))?;
        let mut coordinates = Vec::new();
        for (number, joint) in topology.joints.iter().enumerate() {
            let Some(own) = kinematics.joint(joint.name) else { continue };
            // A joint that mimics another has that joint's.
            if joint.mimic.is_none() && own.positions.len() == 1 {
                coordinates.push((number, own.positions.clone(), own.velocities.clone()));
            }
        }
        let mut random = ChaCha8Rng::seed_from_u64(options.seed ^ hash(context.path()));
        let gyroscope_bias = options.gyroscope_bias * normal(&mut random);
        let accelerometer_bias = options.accelerometer_bias * normal(&mut random);
        Ok(Self {
            path: context.path(),
            world,
            link,
            coordinates,
            positions: kinematics.neutral(),
            velocities: vec![0.0; kinematics.velocities()],
            accelerations: vec![0.0; kinematics.velocities()],
            frames: Frames::new(kinematics),
            gyroscope_bias,
            accelerometer_bias,
            random,
            previous: None,
            options,
        })
    }

    fn read(&mut self, now: MonotonicTime) -> Result<Reading<Imu>, Fault> {
        self.world.check_plugged(self.path)?;
        for (joint, positions, velocities) in &self.coordinates {
            let point = self.world.joint_at(*joint, now).point;
            self.positions.get_mut(positions.clone()).into_iter().flatten().for_each(|at| *at = point.position);
            self.velocities.get_mut(velocities.clone()).into_iter().flatten().for_each(|at| *at = point.velocity);
            let accelerations = self.accelerations.get_mut(velocities.clone());
            accelerations.into_iter().flatten().for_each(|at| *at = point.acceleration);
        }
        self.frames.update_motion(&self.positions, &self.velocities, &self.accelerations)?;
        let motion = self.frames.motion(self.link)?;
        let link_from_root = self.frames.root_from_link(self.link)?.rotation.inverse();
        // The first sample has no predecessor: its noise is that of a short interval.
        let step_s = self.previous.map_or(5e-3, |previous| now.seconds_since(previous)).max(1e-6);
        self.previous = Some(now);
        let per_root_hz = 1.0 / step_s.sqrt();
        let gyroscope_noise = self.options.gyroscope_noise * per_root_hz * normal(&mut self.random);
        let accelerometer_noise = self.options.accelerometer_noise * per_root_hz * normal(&mut self.random);
        let specific_force = motion.acceleration + link_from_root * Vector3::new(0.0, 0.0, GRAVITY);
        Ok(Reading::now(Imu::new(
            motion.angular_velocity + self.gyroscope_bias + gyroscope_noise,
            specific_force + self.accelerometer_bias + accelerometer_noise,
        )))
    }
}

impl fmt::Debug for SimulatedLinkImu {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SimulatedLinkImu").field("path", &self.path).finish_non_exhaustive()
    }
}
