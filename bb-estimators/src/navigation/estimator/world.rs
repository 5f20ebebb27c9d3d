//! Which world the filter works in, and which one it speaks of.

use super::course::point;
use super::input::Mounting;
use super::options::NavigationOptions;
use crate::navigation::geodesy::{Geodetic, LocalFrame};
use crate::navigation::measurement::{AbsolutePose, GnssPosition};
use crate::navigation::track::TrackPoint;
use bb_core::payload::{GnssFix, Pose};
use nalgebra::{Isometry3, Matrix3, Vector3};

/// How far from the origin of its world a filter works, m: there down differs by 0.8 mrad, as much as a good accelerometer's
/// bias.
const FARTHEST: f64 = 5000.0;

/// A filter that is found to be off by more was never near: what began its world was wrong, m.
pub(in crate::navigation) const FARTHEST_JUMP: f64 = 100_000.0;

/// The world that outputs are in has its origin where the filter started. The filter's own is the same until it has left it far
/// behind.
#[derive(Clone, Copy, Debug)]
pub(super) struct World {
    /// On the Earth; none without satellites.
    frame: Option<LocalFrame>,
    /// Where it was at the start.
    first: Option<LocalFrame>,
    first_from_frame: Isometry3<f64>,
    /// So many fixes agreed with it that it did not begin at wrong ones.
    is_confirmed: bool,
}

impl World {
    pub(super) fn new(frame: Option<LocalFrame>) -> Self {
        Self { frame, first: frame, first_from_frame: Isometry3::identity(), is_confirmed: false }
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
        GnssPosition::of_fix(fix, &self.frame?, mounting.antenna(), options.gnss_deviation)
    }

    /// A pose in the outputs' world as a measurement.
    pub(super) fn pose(&self, pose: &Pose, options: &NavigationOptions, mounting: &Mounting) -> AbsolutePose {
        let body_from_sensor = mounting.pose.unwrap_or_else(Isometry3::identity);
        AbsolutePose::of_pose(pose, &body_from_sensor, options.pose_deviation)
            .moved(&self.first_from_frame.inverse())
    }

    /// How far the world's z is below the height above the ellipsoid that it began at, at `position`, m: its plane is no sphere.
    pub(super) fn drop(&self, position: &Vector3<f64>) -> f64 {
        self.frame.map_or(0.0, |frame| frame.geodetic(position).height - frame.origin().height - position.z)
    }

    /// The world of a filter that was wrong by `jump` (m) and is at `position`. Far from the origin of its frame the filter works
    /// in one that begins there; and if no robot could have gone so far, neither did the world begin where it was taken to, unless
    /// many fixes have confirmed it.
    pub(super) fn corrected(&self, position: &Vector3<f64>, jump: f64, is_confirmed: bool) -> Self {
        let is_confirmed = self.is_confirmed || is_confirmed;
        let kept = Self { is_confirmed, ..*self };
        let Some(frame) = self.frame.filter(|_| position.norm() > FARTHEST) else { return kept };
        let place = frame.geodetic(position);
        if jump > FARTHEST_JUMP && !is_confirmed {
            return Self::new(Some(LocalFrame::new(place)));
        }
        let next = LocalFrame::new(Geodetic { height: frame.origin().height, ..place });
        let first_from_frame = self.first_from_frame * next.other_from_self(&frame);
        Self { frame: Some(next), first_from_frame, ..kept }
    }

    /// Coordinates of this world in that of `other`, which is elsewhere on the same Earth.
    pub(super) fn position_in(&self, other: &Self, position: &Vector3<f64>) -> Vector3<f64> {
        match (self.frame, other.frame) {
            (Some(own), Some(others)) => own.other_from_self(&others).transform_point(&(*position).into()).coords,
            _ => *position,
        }
    }

    /// Takes vectors of this world to those of `other`.
    pub(super) fn rotation_to(&self, other: &Self) -> Matrix3<f64> {
        match (self.frame, other.frame) {
            (Some(own), Some(others)) => own.other_from_self(&others).rotation.to_rotation_matrix().into_inner(),
            _ => Matrix3::identity(),
        }
    }

    /// A fix as a point of a track; none if it has no position.
    pub(super) fn point(&self, time_ns: i64, fix: &GnssFix, options: &NavigationOptions) -> Option<TrackPoint> {
        point(time_ns, fix, &self.frame?, options.gnss_deviation)
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
