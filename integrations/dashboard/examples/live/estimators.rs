//! Position of the rover, and the room before it.

use bb_core::nalgebra::{UnitQuaternion, Vector3};
use bb_core::prelude::*;

/// Inputs of [`DeadReckoning`].
#[derive(Clone, Copy, Debug, Inputs)]
pub(crate) struct DeadReckoningInputs<'a> {
    imu: Input<'a, Imu>,
    wheels: Input<'a, Twist>,
}

/// Turns by the gyroscope's rate and moves by the wheels' velocity, on a plane.
#[derive(Debug)]
pub(crate) struct DeadReckoning {
    position: Vector3<f64>,
    yaw: f64,
    last: Option<MonotonicTime>,
}

impl Estimator for DeadReckoning {
    type Options = NoOptions;
    type Input = DeadReckoningInputs<'static>;
    type Output = Pose;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self { position: Vector3::zeros(), yaw: 0.0, last: None })
    }

    fn handle_input(&mut self, inputs: DeadReckoningInputs<'_>) -> Result<Reply<Pose>, Fault> {
        let now = inputs.imu.monotonic_time;
        let step_s = self.last.replace(now).map_or(0.0, |last| now.seconds_since(last)).min(0.05);
        self.yaw += inputs.imu.angular_velocity.z * step_s;
        let world_from_body = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.yaw);
        self.position += world_from_body * inputs.wheels.linear * step_s;
        Ok(Reply::emit(Pose { position: self.position, world_from_body, covariance: None }))
    }
}

/// Room in front of the rover.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub(crate) struct Room {
    /// Smoothed distance to the nearest obstacle.
    #[payload(unit = "m")]
    pub(crate) distance: f64,
    /// `true` if it is nearer than the parameter `nearest`.
    pub(crate) is_near: bool,
}

/// Options of [`Clearance`].
#[derive(Clone, Debug, Options)]
pub(crate) struct ClearanceOptions {
    /// Obstacles nearer than this are reported. Unit: m.
    #[option(required, range = 0.1..=2.0, unit = "m")]
    pub(crate) nearest: f64,
}

/// Smooths the distances of the sonar.
#[derive(Debug)]
pub(crate) struct Clearance {
    nearest: f64,
    distance: Option<f64>,
}

impl Estimator for Clearance {
    type Options = ClearanceOptions;
    type Input = Range;
    type Output = Room;

    fn init(options: ClearanceOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self { nearest: options.nearest, distance: None })
    }

    fn handle_input(&mut self, range: &Stamped<Range>) -> Result<Reply<Room>, Fault> {
        let distance =
            self.distance.map_or(f64::from(range.range), |before| 0.7 * before + 0.3 * f64::from(range.range));
        self.distance = Some(distance);
        Ok(Reply::emit(Room { distance, is_near: distance < self.nearest }))
    }

    fn handle_options(&mut self, options: ClearanceOptions, _: &Context) -> Result<(), Fault> {
        self.nearest = options.nearest;
        Ok(())
    }
}
