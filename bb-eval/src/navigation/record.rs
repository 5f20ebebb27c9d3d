//! Record of what a robot has published of its filter.

use super::feed::{Feed, Time, What};
use bb_core::event::HealthState;
use bb_core::nalgebra::{Matrix6, UnitQuaternion, Vector3};
use bb_core::payload::{GeodeticPosition, Odometry, RelativePose};
use bb_core::prelude::*;
use bb_estimators::navigation::{Geodetic, Verdicts};

/// Virtual time begins this long before the first message, ns.
const BEFORE_NS: i64 = 10_000_000;

/// An estimate of the link.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Estimate {
    pub(crate) time_ns: Time,
    /// Position in the filter's world, m.
    pub(crate) position: Vector3<f64>,
    /// Velocity in the filter's world, m/s.
    pub(crate) velocity: Vector3<f64>,
    pub(crate) world_from_body: UnitQuaternion<f64>,
    /// Angular velocity in the axes of the link, rad/s.
    pub(crate) angular_velocity: Vector3<f64>,
    /// Covariance of the position error, m², then of the rotation error, rad², both in the world.
    pub(crate) covariance: Matrix6<f64>,
    /// The origin of the filter's world.
    pub(crate) origin: Option<Geodetic>,
    /// Delay of the fixes behind their stamps, according to the filter, s.
    pub(crate) delay_s: f64,
    /// Standard deviation of that delay, s.
    pub(crate) delay_deviation_s: f64,
}

impl Estimate {
    /// Converts a message; `None` if it has no covariance.
    pub(crate) fn of(
        time_ns: Time,
        odometry: &Odometry,
        origin: Option<GeodeticPosition>,
        (delay_s, delay_deviation_s): (f64, f64),
    ) -> Option<Self> {
        let Odometry { pose, twist } = odometry;
        let place = |place: GeodeticPosition| Geodetic {
            latitude: place.latitude_rad,
            longitude: place.longitude_rad,
            height: place.altitude.unwrap_or(0.0),
        };
        Some(Self {
            time_ns,
            position: pose.position,
            velocity: pose.world_from_body * twist.linear,
            world_from_body: pose.world_from_body,
            angular_velocity: twist.angular,
            covariance: pose.covariance?,
            origin: origin.map(place),
            delay_s,
            delay_deviation_s,
        })
    }

    /// Returns the estimate at another time near by, at constant velocities.
    pub(crate) fn at(&self, time_ns: Time) -> Self {
        let since_s = (time_ns - self.time_ns) as f64 * 1e-9;
        let turn = UnitQuaternion::from_scaled_axis(self.angular_velocity * since_s);
        Self {
            time_ns,
            position: self.position + self.velocity * since_s,
            world_from_body: self.world_from_body * turn,
            ..*self
        }
    }
}

/// Counts of the measurements of one input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Verdict {
    pub(crate) input: &'static str,
    pub(crate) fused: u64,
    pub(crate) refused: u64,
    /// Number of those since its start that a filter neither fused nor refused: stamped too early or too late.
    pub(crate) unused: u64,
}

/// Record of one run: estimates, health and counts.
#[derive(Clone, Debug, Default)]
pub(crate) struct Record {
    /// Estimates by time.
    pub(crate) estimates: Vec<Estimate>,
    /// Changes of health.
    pub(crate) health: Vec<(Time, HealthState)>,
    /// Reason for which the estimate was not to be trusted, for each sample of the IMU that the filter took.
    pub(crate) reasons: Vec<Option<&'static str>>,
    pub(crate) verdicts: Vec<Verdict>,
    /// Times at which fixes were refused.
    pub(crate) refusals: Vec<Time>,
    last_refused: u64,
    /// Times at which positions in the world were fused.
    pub(crate) positions: Vec<Time>,
    last_fused: u64,
    /// Measurements refused, of a filter that does not count them by input.
    pub(crate) refused: u64,
    pub(crate) resets: u32,
    pub(crate) samples: u64,
    /// The time that the run took.
    pub(crate) seconds: f64,
    /// `true` if the filter estimates no height, roll and pitch.
    pub(crate) is_planar: bool,
    /// The time at which virtual time is zero.
    base_ns: Time,
}

impl Record {
    /// Creates the record before the first message of a feed.
    pub(crate) fn of(feed: &Feed) -> Self {
        let base_ns = feed.first_ns().unwrap_or(0).saturating_sub(BEFORE_NS);
        Self { base_ns, ..Self::default() }
    }

    /// Notes when the filter has refused another fix, or fused another position.
    pub(crate) fn note_positions(&mut self, time_ns: Time, gnss: &Verdicts, pose: &Verdicts) {
        if gnss.refused > self.last_refused {
            self.refusals.push(time_ns);
        }
        self.last_refused = gnss.refused;
        let fused = gnss.fused + pose.fused;
        if fused > self.last_fused {
            self.positions.push(time_ns);
        }
        self.last_fused = fused;
    }

    /// A message whose payload has times, on the robot's clock.
    pub(crate) fn rebased(&self, what: &What) -> What {
        match what {
            What::Relative(relative) => What::Relative(RelativePose {
                start: self.virtual_time(relative.start.as_nanos()),
                end: self.virtual_time(relative.end.as_nanos()),
                ..*relative
            }),
            other => other.clone(),
        }
    }

    pub(crate) fn virtual_time(&self, time_ns: Time) -> MonotonicTime {
        MonotonicTime::from_nanos(time_ns.saturating_sub(self.base_ns))
    }

    pub(crate) fn time_ns(&self, time: MonotonicTime) -> Time {
        time.as_nanos().saturating_add(self.base_ns)
    }
}
