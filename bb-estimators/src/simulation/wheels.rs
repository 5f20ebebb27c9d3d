//! Simulated wheel odometry.

use super::probe::Probe;
use super::random::{hash, normal_one};
use bb_core::payload::{Odometry, Pose, Twist};
use bb_core::{Fault, MonotonicTime, Options, Reading, Sensor, SensorContext};
use nalgebra::{Isometry3, Matrix6, Translation3, UnitQuaternion, Vector3, Vector6};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// The odometry of wheels that drive along x where it is mounted in the
/// [`SimulatedWorld`](super::SimulatedWorld), between wheels that do not move sideways.
///
/// It measures the forward speed and the yaw rate. The sideways speed it reports is 0, even if the robot slides. The pose is
/// the integral of these two, from the origin.
#[derive(Debug)]
pub struct SimulatedWheels {
    options: SimulatedWheelsOptions,
    probe: Probe,
    random: ChaCha8Rng,
    pose: Isometry3<f64>,
    previous: Option<MonotonicTime>,
}

/// Options of [`SimulatedWheels`].
#[derive(Clone, Debug, PartialEq, Options)]
pub struct SimulatedWheelsOptions {
    /// The relative error of the assumed wheel radius: with 0.02, the wheels report 2 % more than the robot drives. Default: 0.
    #[option(default = 0.0, range = -0.5..=0.5)]
    pub scale: f64,
    /// Standard deviation of a speed. Unit: m/s. Default: 0.02 m/s.
    #[option(default = 0.02, range = 0.0..=10.0, unit = "m/s")]
    pub speed_noise: f64,
    /// Standard deviation of a yaw rate. Unit: rad/s. Default: 0.02 rad/s.
    #[option(default = 0.02, range = 0.0..=10.0, unit = "rad/s")]
    pub yaw_rate_noise: f64,
    /// Chooses the noise. Default: 0.
    #[option(default = 0)]
    pub seed: u64,
}

impl Sensor for SimulatedWheels {
    type Options = SimulatedWheelsOptions;
    type Output = Odometry;

    fn init(options: SimulatedWheelsOptions, context: &SensorContext) -> Result<Self, Fault> {
        Ok(Self {
            probe: Probe::new(context)?,
            random: ChaCha8Rng::seed_from_u64(options.seed ^ hash(context.path())),
            pose: Isometry3::identity(),
            previous: None,
            options,
        })
    }

    fn read(&mut self, now: MonotonicTime) -> Result<Reading<Odometry>, Fault> {
        let (_, motion) = self.probe.read(now)?;
        let slip = self.probe.world.slip(self.probe.path());
        let SimulatedWheelsOptions { scale, speed_noise, yaw_rate_noise, .. } = self.options;
        let speed = (motion.velocity.x + slip) * (1.0 + scale) + speed_noise * normal_one(&mut self.random);
        let yaw_rate = motion.angular_velocity.z + yaw_rate_noise * normal_one(&mut self.random);
        let step_s = self.previous.map_or(0.0, |previous| now.seconds_since(previous));
        self.previous = Some(now);
        // Along the chord of the arc.
        let half = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.5 * yaw_rate * step_s);
        let step = Translation3::from(half * Vector3::x() * (speed * step_s));
        self.pose *= Isometry3::from_parts(step, half * half);
        let deviation =
            Vector6::new(speed_noise, speed_noise, speed_noise, yaw_rate_noise, yaw_rate_noise, yaw_rate_noise);
        Ok(Reading::now(Odometry {
            pose: Pose {
                position: self.pose.translation.vector,
                world_from_body: self.pose.rotation,
                covariance: None,
            },
            twist: Twist {
                linear: Vector3::new(speed, 0.0, 0.0),
                angular: Vector3::new(0.0, 0.0, yaw_rate),
                covariance: Some(Matrix6::from_diagonal(&deviation.component_mul(&deviation))),
            },
        }))
    }
}
