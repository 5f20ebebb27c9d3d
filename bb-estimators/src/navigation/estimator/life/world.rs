//! The world that the filter works in, and the one that its outputs refer to.

use crate::navigation::estimator::measured::place_of;
use crate::navigation::geodesy::LocalFrame;
use bb_core::payload::GeodeticPosition;
use nalgebra::{Isometry3, Vector3};

/// The world of the outputs has its origin where the filter started. The filter's own world is the same until it is far from that
/// origin.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation) struct World {
    /// Frame of the world on the Earth. `None` without satellites.
    pub(in crate::navigation) frame: Option<LocalFrame>,
    /// The frame at the start.
    pub(in crate::navigation) first: Option<LocalFrame>,
    /// Transforms coordinates from the filter's world to that of the outputs.
    pub(in crate::navigation) first_from_frame: Isometry3<f64>,
    /// Excess of a barometer's first reading over the height, m.
    pub(in crate::navigation) pressure: Option<f64>,
}

impl World {
    pub(in crate::navigation) fn new(frame: Option<LocalFrame>) -> Self {
        Self { frame, first: frame, first_from_frame: Isometry3::identity(), pressure: None }
    }

    /// Place of the origin of the outputs' world on the Earth. `None` without satellites.
    pub(in crate::navigation) fn origin(&self) -> Option<GeodeticPosition> {
        self.first.map(|frame| place_of(frame.origin()))
    }

    /// Returns the distance of the world's z at `position` below the height above the ellipsoid of its origin, m: its plane does not follow
    /// the ellipsoid.
    pub(in crate::navigation) fn drop(&self, position: &Vector3<f64>) -> f64 {
        self.frame.map_or(0.0, |frame| frame.geodetic(position).height - frame.origin().height - position.z)
    }

    /// Moves the world to the filter if that, at `position`, is far from the origin, and returns the transform of coordinates to it.
    pub(in crate::navigation) fn moves_on(&mut self, position: &Vector3<f64>) -> Option<Isometry3<f64>> {
        let frame = self.frame.as_mut()?;
        let next = frame.moved_on(position)?;
        let next_from_frame = frame.other_from_self(&next);
        self.first_from_frame *= next.other_from_self(frame);
        *frame = next;
        Some(next_from_frame)
    }
}
