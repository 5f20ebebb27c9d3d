//! Payloads as measurements, with the lever arm of their sensor in the body.

use crate::navigation::eskf::ImuMean;
use crate::navigation::geodesy::{Geodetic, LocalFrame};
use crate::navigation::math::skew;
use crate::navigation::measurement::{AbsolutePose, GnssPosition, isotropic};
use crate::navigation::numbers::UNKNOWN_HEIGHT;
use bb_core::Context;
use bb_core::message::Stamped;
use bb_core::payload::{GeodeticPosition, GnssFix, GnssStatus, Imu, Pose};
use nalgebra::{Isometry3, Matrix3, SMatrix, UnitQuaternion, Vector3};

/// A sample of an IMU in the axes of the body.
pub(in crate::navigation) fn sample(imu: &Stamped<Imu>, body_from_imu: &UnitQuaternion<f64>) -> ImuMean {
    ImuMean {
        time_ns: imu.monotonic_time.as_nanos(),
        angular_velocity: body_from_imu * imu.angular_velocity,
        specific_force: body_from_imu * imu.linear_acceleration,
    }
}

/// Pose of the sensor of an input in a body with the axes of the link and its origin at the IMU. `None` for an input that the robot does
/// not declare.
pub(in crate::navigation) fn in_body(
    context: &Context,
    link_from_imu: &Isometry3<f64>,
    input: &str,
) -> Option<Isometry3<f64>> {
    let mut pose = context.frame_from_input(input).ok()?;
    pose.translation.vector -= link_from_imu.translation.vector;
    Some(pose)
}

/// A place on the Earth as a payload.
pub(in crate::navigation) fn place_of(place: &Geodetic) -> GeodeticPosition {
    let Geodetic { latitude, longitude, height } = *place;
    GeodeticPosition { latitude_rad: latitude, longitude_rad: longitude, altitude: Some(height) }
}

/// Covariance of a fix that reports none: of its vertical deviation, twice the horizontal one, m.
pub(in crate::navigation) fn of_fix(deviation: f64) -> Matrix3<f64> {
    let deviations = Vector3::new(1.0, 1.0, 2.0) * deviation;
    Matrix3::from_diagonal(&deviations.component_mul(&deviations))
}

/// The square root of a variance, if it is given.
pub(in crate::navigation) fn deviation(variance: Option<f64>, otherwise: f64) -> f64 {
    variance.filter(|variance| *variance > 0.0).map_or(otherwise, f64::sqrt)
}

/// The heading of the x axis, rad.
pub(in crate::navigation) fn heading(world_from_body: &UnitQuaternion<f64>) -> f64 {
    let ahead = world_from_body * Vector3::x();
    ahead.y.atan2(ahead.x)
}

/// A covariance, if it carries information: in ROS all zeros mean unknown, and no noise has a variance of zero or less.
pub(in crate::navigation) fn told<const D: usize>(
    covariance: Option<SMatrix<f64, D, D>>,
) -> Option<SMatrix<f64, D, D>> {
    covariance.filter(|covariance| (0..D).all(|i| covariance[(i, i)] > 0.0 && covariance[(i, i)].is_finite()))
}

impl Geodetic {
    /// Position of a fix. `height` (m) is used if it has none. Returns `None` if it has no position, or one that is far from the
    /// Earth.
    pub fn of_fix(fix: &GnssFix, height: f64) -> Option<Self> {
        let position = fix.position.filter(|_| fix.status != GnssStatus::NoFix)?;
        let height = position.altitude.unwrap_or(height);
        let (latitude, longitude) = (position.latitude_rad, position.longitude_rad);
        Some(Self { latitude, longitude, height }).filter(Self::is_possible)
    }
}

impl GnssPosition {
    /// A fix in a frame, of an antenna at `lever_arm` in the body (m). Returns `None` if it has no position. `deviation`,
    /// horizontal, m, applies to a fix that reports none. Vertically, twice that is used.
    pub fn of_fix(fix: &GnssFix, frame: &LocalFrame, lever_arm: Vector3<f64>, deviation: f64) -> Option<Self> {
        let geodetic = Geodetic::of_fix(fix, frame.origin().height)?;
        let mut covariance = told(fix.position_covariance).unwrap_or_else(|| of_fix(deviation));
        if fix.position.is_some_and(|position| position.altitude.is_none()) {
            covariance[(2, 2)] = UNKNOWN_HEIGHT * UNKNOWN_HEIGHT;
        }
        Some(Self { position: frame.position(&geodetic), covariance, lever_arm })
    }
}

impl AbsolutePose {
    /// The pose of the body, from that of a sensor in it. `deviation`, m, is that of the position if the pose reports none. A tenth
    /// of it, in rad, applies to the orientation.
    pub fn of_pose(pose: &Pose, body_from_sensor: &Isometry3<f64>, deviation: f64) -> Self {
        let world_from_body = pose.world_from_body * body_from_sensor.rotation.inverse();
        let arm = world_from_body * body_from_sensor.translation.vector;
        let (position, rotation) = match told(pose.covariance) {
            Some(covariance) => {
                let block = |first: usize| covariance.fixed_view::<3, 3>(first, first).into_owned();
                (block(0), block(3))
            }
            None => (isotropic(deviation), isotropic(0.1 * deviation)),
        };
        Self {
            position: pose.position - arm,
            world_from_body,
            position_covariance: position + skew(&arm) * rotation * skew(&arm).transpose(),
            rotation_covariance: rotation,
        }
    }

    /// Returns the pose in another world.
    pub(super) fn moved(&self, new_from_old: &Isometry3<f64>) -> Self {
        let turn = new_from_old.rotation.to_rotation_matrix().into_inner();
        let turned = |covariance: &Matrix3<f64>| turn * covariance * turn.transpose();
        Self {
            position: new_from_old.transform_point(&self.position.into()).coords,
            world_from_body: new_from_old.rotation * self.world_from_body,
            position_covariance: turned(&self.position_covariance),
            rotation_covariance: turned(&self.rotation_covariance),
        }
    }
}
