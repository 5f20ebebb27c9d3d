//! Which world the filter works in, and which one it speaks of.

use super::input::Mounting;
use super::options::NavigationOptions;
use crate::navigation::geodesy::{Geodetic, LocalFrame};
use crate::navigation::math::skew;
use crate::navigation::measurement::{AbsolutePose, GnssPosition};
use bb_core::payload::{GnssFix, GnssStatus, Pose};
use nalgebra::{Isometry3, Matrix3, Vector3};

/// How far from the origin of its world a filter works, m: there down differs by 0.8 mrad, as much as a good accelerometer's
/// bias.
const FARTHEST: f64 = 5000.0;

/// Standard deviation of a height that a fix does not tell, m.
const UNKNOWN_HEIGHT: f64 = 1e4;

/// The world that outputs are in has its origin where the filter started. The filter's own is the same until it has left it far
/// behind.
#[derive(Clone, Copy, Debug)]
pub(super) struct World {
    /// On the Earth; none without satellites.
    frame: Option<LocalFrame>,
    /// Where it was at the start.
    first: Option<LocalFrame>,
    first_from_frame: Isometry3<f64>,
}

impl World {
    pub(super) fn new(frame: Option<LocalFrame>) -> Self {
        Self { frame, first: frame, first_from_frame: Isometry3::identity() }
    }

    /// The frame that outputs are in.
    pub(super) fn first(&self) -> Option<LocalFrame> {
        self.first
    }

    /// Takes coordinates of the filter's world to the one that outputs are in.
    pub(super) fn first_from_frame(&self) -> &Isometry3<f64> {
        &self.first_from_frame
    }

    /// A fix as a measurement; none if it has no position.
    pub(super) fn fix(
        &self,
        fix: &GnssFix,
        options: &NavigationOptions,
        mounting: &Mounting,
    ) -> Option<GnssPosition> {
        let frame = self.frame?;
        let (position, covariance) = position_of(fix, &frame, options.gnss_deviation)?;
        Some(GnssPosition { position, covariance, lever_arm: mounting.antenna() })
    }

    /// A pose in the outputs' world as a measurement.
    pub(super) fn pose(&self, pose: &Pose, options: &NavigationOptions, mounting: &Mounting) -> AbsolutePose {
        let (body_from_sensor, lever_arm) = mounting.of_pose();
        let frame_from_first = self.first_from_frame.inverse();
        let world_from_body = frame_from_first.rotation * pose.world_from_body * body_from_sensor.inverse();
        let arm = world_from_body * lever_arm;
        let turned = frame_from_first.rotation.to_rotation_matrix().into_inner();
        // Of the orientation it is the covariance of a small rotation of the sensor.
        let of_sensor = (frame_from_first.rotation * pose.world_from_body).to_rotation_matrix().into_inner();
        let isotropic = |deviation: f64| Matrix3::identity() * (deviation * deviation);
        let (position, rotation) = match pose.covariance {
            Some(covariance) => {
                let block = |first: usize| covariance.fixed_view::<3, 3>(first, first).into_owned();
                (turned * block(0) * turned.transpose(), of_sensor * block(3) * of_sensor.transpose())
            }
            None => (isotropic(options.pose_deviation), isotropic(0.1 * options.pose_deviation)),
        };
        AbsolutePose {
            position: frame_from_first.transform_point(&pose.position.into()).coords - arm,
            world_from_body,
            position_covariance: position + skew(&arm) * rotation * skew(&arm).transpose(),
            rotation_covariance: rotation,
        }
    }

    /// How far the world's z is below the height above the ellipsoid that it began at, at `position`, m: its plane is no sphere.
    pub(super) fn drop(&self, position: &Vector3<f64>) -> f64 {
        self.frame.map_or(0.0, |frame| frame.geodetic(position).height - frame.origin().height - position.z)
    }

    /// The filter is at `position`: if that is far out, its world moves on, and what takes coordinates there is returned.
    pub(super) fn moves_on(&mut self, position: &Vector3<f64>) -> Option<Isometry3<f64>> {
        let frame = self.frame.as_mut().filter(|_| position.xy().norm() > FARTHEST)?;
        let next = LocalFrame::new(Geodetic { height: frame.origin().height, ..frame.geodetic(position) });
        let next_from_frame = frame.other_from_self(&next);
        self.first_from_frame *= next.other_from_self(frame);
        *frame = next;
        Some(next_from_frame)
    }
}

/// The position of a fix in a frame, and its covariance; none if it has no position. `deviation` is that of a fix that says
/// nothing about its own, horizontal, m; vertical it is twice as much.
pub(in crate::navigation) fn position_of(
    fix: &GnssFix,
    frame: &LocalFrame,
    deviation: f64,
) -> Option<(Vector3<f64>, Matrix3<f64>)> {
    let geodetic = geodetic_of(fix, frame.origin().height)?;
    let deviations = Vector3::new(1.0, 1.0, 2.0) * deviation;
    let mut covariance =
        fix.position_covariance.unwrap_or_else(|| Matrix3::from_diagonal(&deviations.component_mul(&deviations)));
    if fix.position.is_some_and(|position| position.altitude.is_none()) {
        covariance[(2, 2)] = UNKNOWN_HEIGHT * UNKNOWN_HEIGHT;
    }
    Some((frame.position(&geodetic), covariance))
}

/// Where a fix is, at `height` if it does not tell; none if it has no position.
pub(in crate::navigation) fn geodetic_of(fix: &GnssFix, height: f64) -> Option<Geodetic> {
    let position = fix.position.filter(|_| fix.status != GnssStatus::NoFix)?;
    Some(Geodetic {
        latitude: position.latitude_rad,
        longitude: position.longitude_rad,
        height: position.altitude.unwrap_or(height),
    })
}
