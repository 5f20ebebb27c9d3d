//! When positions that the gate refuses are right and the filter is wrong.
//!
//! Raising the covariance until such a position fits would take the difference, however many kilometres, for errors of attitude
//! and biases too, in proportion to their correlations. The filter is moved to where the positions are instead, and keeps what
//! does not depend on where it is.

use crate::navigation::stream::Counts;
use crate::navigation::track::{CONFIRMED, Track, TrackPoint};
use nalgebra::{Matrix3, Vector3};

/// A filter's velocity is kept unless it is off by so many standard deviations from that of the positions.
const SIGMAS: f64 = 5.0;

/// What a velocity that is a mean over seconds is off by, m/s.
const CHANGE: f64 = 1.0;

/// Positions of one sensor, and what they are held against.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::navigation) struct Refuted {
    track: Track,
    /// How many were fused before the filter began where it is.
    fused: u64,
}

/// Where positions show a robot to be.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation) struct Found {
    /// Of the sensor, at a time of its own.
    pub(in crate::navigation) point: TrackPoint,
    /// In the world, with its standard deviation, m/s, if they show that.
    pub(in crate::navigation) velocity: Option<(Vector3<f64>, f64)>,
}

impl Refuted {
    /// Notes a position, fused or refused.
    pub(in crate::navigation) fn see(&mut self, point: TrackPoint) {
        self.track.add(point);
    }

    /// Coordinates are those of another world from now on: those before are forgotten.
    pub(in crate::navigation) fn move_world(&mut self) {
        self.track = Track::default();
    }

    /// The filter has begun elsewhere.
    pub(in crate::navigation) fn begin(&mut self, counts: &Counts) {
        *self = Self { track: Track::default(), fused: counts.fused };
    }

    /// Whether the filter rests on so many positions that what began the world cannot have been wrong.
    pub(in crate::navigation) fn confirms(&self, counts: &Counts, patience: u32) -> bool {
        counts.fused.saturating_sub(self.fused) >= u64::from(patience)
    }

    /// Where the robot is, if the filter is wrong: the last positions were refused, agree among each other, and are more than those
    /// that the filter rests on, or as many as `patience` if that is less. 0: never.
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
    /// The velocity that a filter has to take; none if its own, with that covariance, agrees.
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

    /// Where the sensor is at `now_ns`, with its covariance, for a robot that moves with `velocity`.
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
