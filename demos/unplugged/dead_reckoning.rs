//! The estimator of the rover's pose.

use bb_core::nalgebra::{UnitQuaternion, Vector3};
use bb_core::prelude::*;

/// Inputs of the estimator.
#[derive(Clone, Copy, Debug, Inputs)]
pub(crate) struct DeadReckoningInputs<'a> {
    imu: Input<'a, Imu>,
    wheels: Input<'a, Twist>,
}

/// Options of [`DeadReckoning`].
#[derive(Clone, Debug, Options)]
pub(crate) struct DeadReckoningOptions {
    /// Longest gap between two dispatches that is integrated over. Unit: s.
    #[option(default = Duration::from_millis(50))]
    pub(crate) longest_step: Duration,
}

/// Integrates the gyroscope's rate and the wheels' velocity on a plane. Its error grows without bound, and motion during a gap
/// of the input is lost.
#[derive(Debug)]
pub(crate) struct DeadReckoning {
    longest_step: Duration,
    position: Vector3<f64>,
    yaw: f64,
    last: Option<MonotonicTime>,
}

impl Estimator for DeadReckoning {
    type Options = DeadReckoningOptions;
    type Input = DeadReckoningInputs<'static>;
    type Output = Pose;

    fn init(options: DeadReckoningOptions, _: &Context) -> Result<Self, Fault> {
        let longest_step = options.longest_step;
        Ok(Self { longest_step, position: Vector3::zeros(), yaw: 0.0, last: None })
    }

    fn handle_input(&mut self, inputs: DeadReckoningInputs<'_>) -> Result<Reply<Pose>, Fault> {
        let now = inputs.imu.monotonic_time;
        let step = self.last.replace(now).map_or(Duration::ZERO, |last| now.duration_since(last));
        if step <= self.longest_step {
            let turn = inputs.imu.angular_velocity.z * step.as_secs_f64();
            // The velocity is turned by the heading in the middle of the step.
            let world_from_body = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.yaw + turn / 2.0);
            self.position += world_from_body * inputs.wheels.linear * step.as_secs_f64();
            self.yaw += turn;
        }
        let world_from_body = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.yaw);
        Ok(Reply::emit(Pose { position: self.position, world_from_body, covariance: None }))
    }
}
