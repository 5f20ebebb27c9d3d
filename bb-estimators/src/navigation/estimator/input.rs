//! What the declared filter takes, and where its sensors are.

use crate::navigation::eskf::ImuMean;
use bb_core::message::Stamped;
use bb_core::payload::{GnssFix, Imu, Odometry, Pose};
use bb_core::{Context, Fault, Input, Inputs};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

/// The inputs of [`EskfEstimator`](super::EskfEstimator).
#[derive(Clone, Copy, Debug, Inputs)]
pub struct NavigationInputs<'a> {
    /// The inertial sensor: the driver.
    pub imu: Input<'a, Imu>,
    /// Satellite navigation.
    pub gnss: Option<Input<'a, GnssFix>>,
    /// Wheels, or anything else that counts its own motion: of an odometry, the velocity is used.
    pub odometry: Option<Input<'a, Odometry>>,
    /// Poses in the world, from a map or a tracking system.
    pub pose: Option<Input<'a, Pose>>,
}

/// Where the sensors are.
///
/// The body of the filter has the axes of the link, and its origin where the IMU is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mounting {
    link_from_imu: Isometry3<f64>,
    link_from_gnss: Option<Isometry3<f64>>,
    link_from_odometry: Option<Isometry3<f64>>,
    link_from_pose: Option<Isometry3<f64>>,
}

impl Mounting {
    /// As the robot declares them.
    pub(super) fn of(context: &Context) -> Result<Self, Fault> {
        // Of inputs that the robot does not declare, there is none.
        let optional = |name: &str| context.frame_from_input(name).ok();
        Ok(Self {
            link_from_imu: context.frame_from_driver()?,
            link_from_gnss: optional("gnss"),
            link_from_odometry: optional("odometry"),
            link_from_pose: optional("pose"),
        })
    }

    /// Whether something measures the position in the world.
    pub(super) fn has_positions(&self) -> bool {
        self.has_gnss() || self.link_from_pose.is_some()
    }

    pub(super) fn has_gnss(&self) -> bool {
        self.link_from_gnss.is_some()
    }

    /// The sample in the axes of the link.
    pub(super) fn sample(&self, imu: &Stamped<Imu>) -> ImuMean {
        let rotation = self.link_from_imu.rotation;
        ImuMean {
            time_ns: imu.monotonic_time.as_nanos(),
            angular_velocity: rotation * imu.angular_velocity,
            specific_force: rotation * imu.linear_acceleration,
        }
    }

    /// The antenna in the body, m.
    pub(super) fn antenna(&self) -> Vector3<f64> {
        self.in_body(self.link_from_gnss.as_ref())
    }

    /// The link's origin in the body, m.
    pub(super) fn link(&self) -> Vector3<f64> {
        -self.link_from_imu.translation.vector
    }

    /// The sensor of the odometry in the body.
    pub(super) fn odometry(&self) -> Isometry3<f64> {
        self.sensor(self.link_from_odometry.as_ref())
    }

    /// The sensor of poses in the body.
    pub(super) fn pose(&self) -> Isometry3<f64> {
        self.sensor(self.link_from_pose.as_ref())
    }

    fn sensor(&self, link_from_sensor: Option<&Isometry3<f64>>) -> Isometry3<f64> {
        let rotation = link_from_sensor.map_or(UnitQuaternion::identity(), |sensor| sensor.rotation);
        Isometry3::from_parts(self.in_body(link_from_sensor).into(), rotation)
    }

    /// Where a sensor is in the body, m.
    fn in_body(&self, link_from_sensor: Option<&Isometry3<f64>>) -> Vector3<f64> {
        let sensor = link_from_sensor.map_or(Vector3::zeros(), |sensor| sensor.translation.vector);
        sensor - self.link_from_imu.translation.vector
    }
}
