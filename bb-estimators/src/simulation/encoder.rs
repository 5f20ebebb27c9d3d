//! A simulated encoder.

use super::SimulatedWorld;
use super::random::{hash, normal_one};
use bb_core::payload::JointState;
use bb_core::{Fault, MonotonicTime, Options, Reading, Sensor, SensorContext};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use std::sync::Arc;

/// An encoder that measures its joint in the [`SimulatedWorld`]: position, velocity and effort.
#[derive(Debug)]
pub struct SimulatedEncoder {
    options: SimulatedEncoderOptions,
    path: &'static str,
    joint: &'static str,
    world: Arc<SimulatedWorld>,
    random: ChaCha8Rng,
}

/// Options of [`SimulatedEncoder`].
#[derive(Clone, Debug, PartialEq, Options)]
pub struct SimulatedEncoderOptions {
    /// Distance between two positions that it can tell apart, rad or m. Default: 0, all of them.
    #[option(default = 0.0, range = 0.0..=1e3)]
    pub resolution: f64,
    /// Standard deviation of a position, rad or m. Default: 0.
    #[option(default = 0.0, range = 0.0..=1e3)]
    pub noise: f64,
    /// Standard deviation of a velocity, rad/s or m/s. Default: 0.
    #[option(default = 0.0, range = 0.0..=1e3)]
    pub velocity_noise: f64,
    /// Chooses the noise. Default: 0.
    #[option(default = 0)]
    pub seed: u64,
}

impl Sensor for SimulatedEncoder {
    type Options = SimulatedEncoderOptions;
    type Output = JointState;

    fn init(options: SimulatedEncoderOptions, context: &SensorContext) -> Result<Self, Fault> {
        let world = context.shared(|| SimulatedWorld::new(context.topology()));
        world.check_plugged(context.path())?;
        let joint = context.frame().name();
        if context.topology().joint(joint).is_none() {
            return Err(Fault::permanent("it measures a joint; declare it in one"));
        }
        let random = ChaCha8Rng::seed_from_u64(options.seed ^ hash(context.path()));
        Ok(Self { options, path: context.path(), joint, world, random })
    }

    fn read(&mut self, now: MonotonicTime) -> Result<Reading<JointState>, Fault> {
        self.world.check_plugged(self.path)?;
        let state = self.world.joint(self.joint, now)?;
        let SimulatedEncoderOptions { resolution, noise, velocity_noise, .. } = self.options;
        let noisy = state.point.position + noise * normal_one(&mut self.random);
        let position = if resolution > 0.0 { (noisy / resolution).round() * resolution } else { noisy };
        let velocity = state.point.velocity + velocity_noise * normal_one(&mut self.random);
        Ok(Reading::now(JointState { position, velocity: Some(velocity), effort: Some(state.effort) }))
    }
}
