//! Whether positions agree with earlier ones. A position that does not fit overrules the estimate only if they do.

use nalgebra::{Matrix3, Vector3};

use super::strategy::{PATIENCE, Trust};
use super::world::World;
use crate::navigation::geodesy::{Geodetic, LocalFrame};
use crate::navigation::track::{Track, TrackPoint};

#[cfg(test)]
mod tests;

/// Largest speed of an aircraft, m/s.
const FASTEST: f64 = 1000.0;

/// Positions further apart in time than this cannot be compared, ns: anchors may be slow.
const LONGEST_NS: i64 = 600_000_000_000;

/// Error of a velocity that is a mean over seconds, m/s.
const CHANGE: f64 = 1.0;

/// The positions of one kind of source, in a separate frame: changes to the world of the estimate do not affect them.
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
    /// Adds a position with its covariance. Returns whether it may overrule the estimate: one more than the number that must be
    /// refused first have to agree.
    pub(super) fn add(&mut self, time_ns: i64, position: &Geodetic, covariance: &Matrix3<f64>) -> Trust {
        // Another provider may have sent a position with the same stamp. The track cannot confirm a position that it does not
        // contain.
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

    /// The velocity of the positions, in `world`, and its covariance.
    pub(super) fn velocity(&self, world: &World) -> Option<(Vector3<f64>, Matrix3<f64>)> {
        let (velocity, deviation) = self.track.velocity()?;
        let world_from_own = self.frame?.other_from_self(world.frame()).rotation;
        Some((world_from_own * velocity, Matrix3::identity() * (deviation * deviation + CHANGE * CHANGE)))
    }
}
