//! Recovery when positions that the gate refuses are right and the filter is wrong.
//!
//! Raising the covariance until such a position fits would also attribute the difference, possibly kilometres, to errors of
//! attitude and biases, in proportion to their correlations. Instead, the filter is moved to the positions. It keeps all states
//! that do not depend on its location.

use crate::navigation::stream::Counts;
use crate::navigation::track::{CONFIRMED, Track, TrackPoint};
use nalgebra::{Matrix3, Vector3};

/// A filter keeps its velocity unless it differs from that of the positions by this many standard deviations.
const SIGMAS: f64 = 5.0;

/// Error of a velocity that is a mean over seconds, m/s.
const CHANGE: f64 = 1.0;

/// Positions of one sensor, and the count they are compared with.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::navigation) struct Refuted {
    track: Track,
    /// Number fused before the filter was last started or moved.
    fused: u64,
}

/// Location of a robot as shown by positions.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation) struct Found {
    /// Position of the sensor, with its own time stamp.
    pub(in crate::navigation) point: TrackPoint,
    /// In the world, with its standard deviation, m/s, if the positions determine it.
    pub(in crate::navigation) velocity: Option<(Vector3<f64>, f64)>,
}

impl Refuted {
    /// Records a position, fused or refused.
    pub(in crate::navigation) fn see(&mut self, point: TrackPoint) {
        self.track.add(point);
    }

    /// The filter has been started or moved elsewhere.
    pub(in crate::navigation) fn begin(&mut self, counts: &Counts) {
        *self = Self { track: Track::default(), fused: counts.fused };
    }

    /// Whether the filter rests on enough positions to rule out a wrong origin of the world.
    pub(in crate::navigation) fn confirms(&self, counts: &Counts, patience: u32) -> bool {
        counts.fused.saturating_sub(self.fused) >= u64::from(patience)
    }

    /// Position of the robot, if the filter is wrong. The last positions must have been refused and must agree with each other.
    /// They must also outnumber those that the filter rests on, or reach `patience` if that is less. With 0, the result is always
    /// `None`.
    pub(in crate::navigation) fn verdict(&self, counts: &Counts, patience: u32) -> Option<Found> {
        let confirmed = u64::from(CONFIRMED);
        let rests_on = confirmed + counts.fused.saturating_sub(self.fused);
        let needed = (rests_on + 1).min(u64::from(patience)).max(confirmed);
        let agree = u64::from(self.track.count()).min(counts.gate_in_a_row);
        if patience == 0 || agree < needed {
            return None;
        }
        Some(Found { point: *self.track.newest()?, velocity: self.track.velocity() })
    }
}

impl Found {
    /// The velocity to set in the filter. `None` if its own, with that covariance, agrees.
    pub(in crate::navigation) fn new_velocity(
        &self,
        own: &Vector3<f64>,
        covariance: &Matrix3<f64>,
    ) -> Option<(Vector3<f64>, Matrix3<f64>)> {
        let (velocity, deviation) = self.velocity?;
        let variance = deviation * deviation + CHANGE * CHANGE;
        let most = SIGMAS * (covariance.trace() + variance).sqrt();
        let agrees = (velocity - own).norm() <= most;
        (!agrees).then(|| (velocity, Matrix3::identity() * variance))
    }

    /// Position of the sensor at `now_ns`, with its covariance, for a robot that moves with `velocity`.
    pub(in crate::navigation) fn at(
        &self,
        now_ns: i64,
        velocity: &Vector3<f64>,
        covariance: &Matrix3<f64>,
    ) -> (Vector3<f64>, Matrix3<f64>) {
        let since_s = now_ns.saturating_sub(self.point.time_ns) as f64 * 1e-9;
        (self.point.position + velocity * since_s, self.point.covariance + covariance * (since_s * since_s))
    }
}
