//! Inputs of the declared filter, and the mounting of their sensors.

use super::options::PlanarOptions;
use crate::navigation::estimator::measured::{deviation, heading, told};
use crate::navigation::geodesy::LocalFrame;
use crate::navigation::measurement::GnssPosition;
use crate::navigation::numbers::UPRIGHT;
use crate::navigation::planar::measurement::{PlanarHeading, PlanarPose, PlanarPosition, WheelVelocity, YawRate};
use bb_core::payload::{GnssFix, Imu, Odometry, Orientation, Pose};
use bb_core::{Context, Fault, Input, Inputs};
use nalgebra::{Isometry3, Matrix2, Matrix3, UnitQuaternion, Vector2, Vector3};

/// The inputs of [`PlanarEstimator`](super::PlanarEstimator).
#[derive(Clone, Copy, Debug, Inputs)]
pub struct PlanarInputs<'a> {
    /// The inertial sensor, mounted in any direction: the driver. Only its yaw rate is used.
    pub imu: Input<'a, Imu>,
    /// Satellite navigation.
    pub gnss: Option<Input<'a, GnssFix>>,
    /// Wheel odometry: its velocity and yaw rate are used.
    pub odometry: Option<Input<'a, Odometry>>,
    /// Poses in the world, from a map or a tracking system.
    pub pose: Option<Input<'a, Pose>>,
    /// An orientation in the world, from a compass or an attitude filter: the heading is used.
    pub orientation: Option<Input<'a, Orientation>>,
}

/// Options, and the mounting of the sensors.
///
/// The body of the filter is the frame of the odometry, where wheels do not move sideways; without one, the link.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation) struct Setup {
    pub(super) options: PlanarOptions,
    pub(super) body_from_link: Isometry3<f64>,
    pub(super) body_from_imu: UnitQuaternion<f64>,
    antenna: Option<Vector2<f64>>,
    pub(super) body_from_pose: Option<Isometry3<f64>>,
    pub(super) body_from_orientation: Option<UnitQuaternion<f64>>,
    pub(super) has_wheels: bool,
}

impl Setup {
    /// The mounting that the robot declares.
    pub(super) fn new(options: PlanarOptions, context: &Context) -> Result<Self, Fault> {
        // Inputs that the robot does not declare have no mounting.
        let optional = |name: &str| context.frame_from_input(name).ok();
        let link_from_body = optional("odometry").unwrap_or_else(Isometry3::identity);
        if (link_from_body.rotation * Vector3::z()).z < UPRIGHT {
            return Err(Fault::new(
                "the frame of the input `odometry` is not level: its z axis must be that of the link where the planar filter is \
                 declared",
            ));
        }
        let body_from_link = link_from_body.inverse();
        Ok(Self {
            options,
            body_from_link,
            body_from_imu: body_from_link.rotation * context.frame_from_driver()?.rotation,
            antenna: optional("gnss").map(|gnss| (body_from_link * gnss).translation.vector.xy()),
            body_from_pose: optional("pose").map(|pose| body_from_link * pose),
            body_from_orientation: optional("orientation").map(|sensor| body_from_link.rotation * sensor.rotation),
            has_wheels: optional("odometry").is_some(),
        })
    }

    pub(super) fn has_gnss(&self) -> bool {
        self.antenna.is_some()
    }

    /// Returns whether something measures the position in the world.
    pub(super) fn has_positions(&self) -> bool {
        self.has_gnss() || self.body_from_pose.is_some()
    }

    /// The antenna's position in the body, m.
    pub(super) fn antenna(&self) -> Vector2<f64> {
        self.antenna.unwrap_or_else(Vector2::zeros)
    }

    /// A fix in a frame; `None` if it has no position.
    pub(super) fn fix(&self, fix: &GnssFix, frame: &LocalFrame) -> Option<PlanarPosition> {
        let fix = GnssPosition::of_fix(fix, frame, Vector3::zeros(), self.options.gnss_deviation)?;
        let covariance = fix.covariance.fixed_view::<2, 2>(0, 0).into_owned();
        Some(PlanarPosition { position: fix.position.xy(), covariance, lever_arm: self.antenna() })
    }

    /// The velocity and yaw rate from wheel odometry.
    pub(super) fn wheels(&self, odometry: &Odometry) -> (WheelVelocity, YawRate) {
        let square = |x: f64| x * x;
        let covariance = odometry.twist.covariance;
        let stated = |i: usize| covariance.map_or(0.0, |covariance| covariance[(i, i)]);
        let variance = |i: usize, least: f64| stated(i).max(square(least));
        let mut velocity = odometry.twist.linear.xy();
        let mut noise = Matrix2::new(variance(0, self.options.odometry_deviation), 0.0, 0.0, 0.0);
        if self.options.omnidirectional {
            noise[(1, 1)] = variance(1, self.options.odometry_deviation);
            let between = covariance.map_or(0.0, |covariance| 0.5 * (covariance[(0, 1)] + covariance[(1, 0)]));
            (noise[(0, 1)], noise[(1, 0)]) = (between, between);
        } else {
            velocity.y = 0.0;
            noise[(1, 1)] = square(self.options.sideways_deviation);
        }
        let deviation = variance(5, self.options.yaw_rate_deviation).sqrt();
        let velocity = WheelVelocity { velocity, covariance: noise, lever_arm: Vector2::zeros() };
        (velocity, YawRate { rate: odometry.twist.angular.z, deviation })
    }

    /// Converts a pose of its sensor to a pose of the body.
    pub(super) fn pose(&self, pose: &Pose) -> PlanarPose {
        let body_from_sensor = self.body_from_pose.unwrap_or_else(Isometry3::identity);
        let world_from_body = pose.world_from_body * body_from_sensor.rotation.inverse();
        let heading = heading(&world_from_body);
        let arm = (UnitQuaternion::from_euler_angles(0.0, 0.0, heading) * body_from_sensor.translation.vector).xy();
        let square = |x: f64| x * x;
        let (position, of_heading) = match told(pose.covariance) {
            Some(covariance) => (covariance.fixed_view::<2, 2>(0, 0).into_owned(), covariance[(5, 5)]),
            None => (
                Matrix2::identity() * square(self.options.pose_deviation),
                square(0.1 * self.options.pose_deviation),
            ),
        };
        // The heading determines the position of the body's origin, which therefore shares the heading's error.
        let by_heading = Vector2::new(arm.y, -arm.x);
        let mut covariance = Matrix3::zeros();
        let own = position + by_heading * by_heading.transpose() * of_heading;
        covariance.fixed_view_mut::<2, 2>(0, 0).copy_from(&own);
        covariance.fixed_view_mut::<2, 1>(0, 2).copy_from(&(by_heading * of_heading));
        covariance.fixed_view_mut::<1, 2>(2, 0).copy_from(&(by_heading * of_heading).transpose());
        covariance[(2, 2)] = of_heading;
        PlanarPose { position: pose.position.xy() - arm, heading, covariance }
    }

    /// The heading of the body, from an orientation of its sensor.
    pub(super) fn heading(&self, orientation: &Orientation) -> PlanarHeading {
        let body_from_sensor = self.body_from_orientation.unwrap_or_else(UnitQuaternion::identity);
        let world_from_body = orientation.world_from_body * body_from_sensor.inverse();
        let variance = orientation.covariance.map(|covariance| about_up(&orientation.world_from_body, &covariance));
        PlanarHeading {
            heading: heading(&world_from_body),
            deviation: deviation(variance, self.options.orientation_deviation),
        }
    }
}

/// The variance about the vertical, from the covariance of a small rotation of the body, rad².
fn about_up(world_from_body: &UnitQuaternion<f64>, covariance: &Matrix3<f64>) -> f64 {
    let up = world_from_body.inverse() * Vector3::z();
    up.dot(&(covariance * up))
}
