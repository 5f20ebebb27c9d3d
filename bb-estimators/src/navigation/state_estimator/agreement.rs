//! Whether positions agree with those before: one that does not fit overrules the estimate only if they do.

use nalgebra::{Matrix3, Vector3};

use super::strategy::{PATIENCE, Trust};
use super::world::World;
use crate::navigation::geodesy::{Geodetic, LocalFrame};
use crate::navigation::track::{Track, TrackPoint};

#[cfg(test)]
mod tests;

/// No aircraft is faster, m/s.
const FASTEST: f64 = 1000.0;

/// Positions that are farther apart in time tell nothing of each other, ns: anchors may be slow.
const LONGEST_NS: i64 = 600_000_000_000;

/// What a velocity that is a mean over seconds is off by, m/s.
const CHANGE: f64 = 1.0;

/// The positions of one kind of source, in a frame of their own: they agree whatever becomes of the world of the estimate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Agreement {
    frame: Option<LocalFrame>,
    track: Track,
}

impl Default for Agreement {
    fn default() -> Self {
        Self { frame: None, track: Track::with(FASTEST, LONGEST_NS) }
    }
}

impl Agreement {
    /// Adds a position with its covariance; what it may do. As many as must be refused before, and one more, agree if it may
    /// overrule the estimate.
    pub(super) fn add(&mut self, time_ns: i64, position: &Geodetic, covariance: &Matrix3<f64>) -> Trust {
        // Another provider may have spoken of the same moment: what is no part of the track is not confirmed by it.
        if self.track.newest().is_some_and(|newest| time_ns <= newest.time_ns) {
            return Trust::Doubted;
        }
        let frame = self.frame.get_or_insert_with(|| LocalFrame::new(*position));
        let point = TrackPoint { time_ns, position: frame.position(position), covariance: *covariance, yaw: 0.0 };
        if !self.track.add(point) {
            // The frame stays near the track.
            self.frame = Some(LocalFrame::new(*position));
            self.track = Track::with(FASTEST, LONGEST_NS);
            self.track.add(TrackPoint { position: Vector3::zeros(), ..point });
        }
        if self.track.count() > PATIENCE { Trust::Believed } else { Trust::Doubted }
    }

    /// The velocity that the positions show, in a world, and its covariance.
    pub(super) fn velocity(&self, world: &World) -> Option<(Vector3<f64>, Matrix3<f64>)> {
        let (velocity, deviation) = self.track.velocity()?;
        let world_from_own = self.frame?.other_from_self(world.frame()).rotation;
        Some((world_from_own * velocity, Matrix3::identity() * (deviation * deviation + CHANGE * CHANGE)))
    }
}
