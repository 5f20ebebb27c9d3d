//! Finds positions that agree with each other: a filter may start at them, or they show that it is wrong.

use nalgebra::{Matrix3, Vector3};

use super::math::{cos, sin, sqrt};
use crate::navigation::numbers::{
    CLEARLY, FASTEST, LONGEST_TRACK_NS, STRONGEST, TRACK_BASELINE_NS, TRACK_DEVIATIONS,
};

#[cfg(test)]
mod tests;

/// A measured position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackPoint {
    /// Time of the measurement, ns.
    pub time_ns: i64,
    /// Position in the world, m.
    pub position: Vector3<f64>,
    /// Covariance of the position, m².
    pub covariance: Matrix3<f64>,
    /// Accumulated yaw of the robot since any fixed time, rad, from a gyroscope; the same for all points without one.
    pub yaw: f64,
}

impl TrackPoint {
    /// Standard deviation of the horizontal position, m.
    pub fn deviation(&self) -> f64 {
        sqrt((self.covariance.fixed_view::<2, 2>(0, 0).trace() / 2.0).max(0.0))
    }
}

/// A sequence of positions that a robot may have measured on its way. Each agrees with the extrapolation of the two before, up to
/// their noise and an acceleration of 1 g. A position that does not agree starts a new track.
///
/// ```
/// use bb_estimators::navigation::{CONFIRMED, Track, TrackPoint};
/// use nalgebra::{Matrix3, Vector3};
///
/// let mut track = Track::default();
/// // A receiver that begins with where it was switched off.
/// for (second, east) in [(0, 9000.0), (1, 0.0), (2, 10.0), (3, 20.0)] {
///     let position = Vector3::new(east, 0.0, 0.0);
///     let (time_ns, covariance) = (second * 1_000_000_000, Matrix3::identity());
///     track.add(TrackPoint { time_ns, position, covariance, yaw: 0.0 });
/// }
/// assert_eq!(track.count(), CONFIRMED);
/// assert!(track.velocity().is_some_and(|(velocity, _)| (velocity.x - 10.0).abs() < 1e-9));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Track {
    /// The largest speed of the robot, m/s.
    fastest: f64,
    /// The longest time between two positions that can be compared, ns.
    longest_ns: i64,
    count: u32,
    newest: Option<TrackPoint>,
    before: Option<TrackPoint>,
    /// The other end of the baseline for the velocity.
    older: Option<TrackPoint>,
}

impl Default for Track {
    /// Creates a track for a robot slower than 150 m/s; positions more than a minute apart do not agree.
    fn default() -> Self {
        Self::with(FASTEST, LONGEST_TRACK_NS)
    }
}

impl Track {
    /// Creates a track for a robot slower than `fastest`, m/s; positions more than `longest_ns` apart do not agree.
    pub fn with(fastest: f64, longest_ns: i64) -> Self {
        Self { fastest, longest_ns, count: 0, newest: None, before: None, older: None }
    }

    /// Adds a position. Returns `false` and starts a new track if the position does not agree with the previous ones. A position
    /// that is not newer is ignored.
    pub fn add(&mut self, point: TrackPoint) -> bool {
        let Some(newest) = self.newest else {
            self.begin(point);
            return true;
        };
        if point.time_ns <= newest.time_ns {
            return true;
        }
        if !self.leads_to(&newest, &point) {
            self.begin(point);
            return false;
        }
        self.count = self.count.saturating_add(1);
        let longest_ns = *TRACK_BASELINE_NS.end();
        if self.older.is_none_or(|older| point.time_ns.saturating_sub(older.time_ns) > longest_ns) {
            self.older = Some(newest);
        }
        self.before = Some(newest);
        self.newest = Some(point);
        true
    }

    fn begin(&mut self, point: TrackPoint) {
        *self = Self { count: 1, newest: Some(point), before: None, older: Some(point), ..*self };
    }

    fn leads_to(&self, newest: &TrackPoint, point: &TrackPoint) -> bool {
        let since_ns = point.time_ns.saturating_sub(newest.time_ns);
        if since_ns > self.longest_ns {
            return false;
        }
        let since_s = since_ns as f64 * 1e-9;
        let apart = point.position - newest.position;
        let (off, covariance, slack) = match &self.before {
            None => (apart, point.covariance + newest.covariance, self.fastest * since_s),
            Some(before) => {
                let between_s = newest.time_ns.saturating_sub(before.time_ns) as f64 * 1e-9;
                let ratio = since_s / between_s;
                let own = point.covariance + newest.covariance * ((1.0 + ratio) * (1.0 + ratio));
                let bent = 0.5 * STRONGEST * since_s * (since_s + between_s);
                let ahead = (newest.position - before.position) * ratio;
                // A velocity from two positions that are close in time is no more than a guess.
                let slack = bent.min(2.0 * self.fastest * since_s);
                (apart - ahead, own + before.covariance * (ratio * ratio), slack)
            }
        };
        let horizontal = (covariance[(0, 0)] + covariance[(1, 1)]) / 2.0;
        let is_near = |distance: f64, variance: f64| distance <= TRACK_DEVIATIONS * sqrt(variance.max(0.0)) + slack;
        // Also rejects NaN.
        is_near(off.xy().norm(), horizontal) && is_near(off.z.abs(), covariance[(2, 2)])
    }

    /// The number of positions that agree, including the newest.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// The newest position.
    pub fn newest(&self) -> Option<&TrackPoint> {
        self.newest.as_ref()
    }

    /// The velocity in the world with its standard deviation, m/s, which grows with the turn on the way. It is taken between the
    /// last two positions if they determine it clearly, and otherwise over the last seconds. `None` if the positions are less
    /// than 0.5 s or more than 5 s apart.
    pub fn velocity(&self) -> Option<(Vector3<f64>, f64)> {
        let is_clear = |(velocity, deviation): &(Vector3<f64>, f64)| velocity.xy().norm() > CLEARLY * deviation;
        self.since(self.before).filter(is_clear).or_else(|| self.since(self.older))
    }

    fn since(&self, older: Option<TrackPoint>) -> Option<(Vector3<f64>, f64)> {
        let (newest, older) = (self.newest?, older?);
        let between_ns = newest.time_ns.saturating_sub(older.time_ns);
        if !TRACK_BASELINE_NS.contains(&between_ns) {
            return None;
        }
        let seconds = between_ns as f64 * 1e-9;
        let (one, other) = (newest.deviation(), older.deviation());
        let noise = sqrt(one * one + other * other) / seconds;
        let mean = (newest.position - older.position) / seconds;
        // On an arc, the chord lags by half of the turn and is shorter than the path. Where on the path the robot turned is
        // unknown.
        let turn = newest.yaw - older.yaw;
        let half = turn.clamp(-1.5, 1.5) / 2.0;
        let longer = if half.abs() < 1e-3 { 1.0 } else { half / sin(half) };
        let (along, across) = (longer * cos(half), longer * sin(half));
        let velocity = Vector3::new(along * mean.x - across * mean.y, across * mean.x + along * mean.y, mean.z);
        let swing = velocity.xy().norm() * turn.abs() / 4.0;
        Some((velocity, sqrt(noise * noise + swing * swing)))
    }
}
