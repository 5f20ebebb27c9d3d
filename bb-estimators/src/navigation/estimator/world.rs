//! The world that the filter works in, and the one that its outputs refer to.

use super::input::Mounting;
use super::options::NavigationOptions;
use crate::navigation::geodesy::LocalFrame;
use crate::navigation::measurement::{AbsolutePose, GnssPosition};
use bb_core::payload::{GnssFix, Pose};
use nalgebra::{Isometry3, Vector3};

/// The world of the outputs has its origin where the filter started. The filter's own world is the same until it is far from that
/// origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct World {
    /// Frame of the world on the Earth. `None` without satellites.
    frame: Option<LocalFrame>,
    /// The frame at the start.
    first: Option<LocalFrame>,
    first_from_frame: Isometry3<f64>,
}

impl World {
    pub(super) fn new(frame: Option<LocalFrame>) -> Self {
        Self { frame, first: frame, first_from_frame: Isometry3::identity() }
    }

    /// The frame of the outputs.
    pub(super) fn first(&self) -> Option<LocalFrame> {
        self.first
    }

    /// Transforms coordinates from the filter's world to that of the outputs.
    pub(super) fn first_from_frame(&self) -> &Isometry3<f64> {
        &self.first_from_frame
    }

    /// A fix as a measurement. `None` if it has no position.
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

    /// Returns the distance of the world's z at `position` below the height above the ellipsoid of its origin, m: its plane does not follow
    /// the ellipsoid.
    pub(super) fn drop(&self, position: &Vector3<f64>) -> f64 {
        self.frame.map_or(0.0, |frame| frame.geodetic(position).height - frame.origin().height - position.z)
    }

    /// Moves the world to the filter if that, at `position`, is far from the origin, and returns the transform of coordinates to it.
    pub(super) fn moves_on(&mut self, position: &Vector3<f64>) -> Option<Isometry3<f64>> {
        let frame = self.frame.as_mut()?;
        let next = frame.moved_on(position)?;
        let next_from_frame = frame.other_from_self(&next);
        self.first_from_frame *= next.other_from_self(frame);
        *frame = next;
        Some(next_from_frame)
    }
}
