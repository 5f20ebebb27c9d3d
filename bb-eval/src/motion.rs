//! The motion that an IMU measures, in an inertial frame that is level and true to north only by chance, and what other sensors
//! show beside it.

pub mod latency;
pub mod scatter;

use bb_core::nalgebra::{UnitQuaternion, Vector3};

/// Longest time between samples over which the motion is known, s.
const LONGEST_S: f64 = 0.2;

/// A sample: stamp in nanoseconds, angular velocity, specific force.
pub type Sample = (i64, Vector3<f64>, Vector3<f64>);

/// The integrated motion. Its way falls with gravity, which third differences do not see.
#[derive(Debug, Default)]
pub struct Motion {
    points: Vec<Point>,
    /// The times of the points that have no motion behind them.
    breaks: Vec<f64>,
}

#[derive(Clone, Copy, Debug)]
struct Point {
    /// Time since the zero of the recording, s.
    time_s: f64,
    inertial_from_body: UnitQuaternion<f64>,
    way: Vector3<f64>,
    velocity: Vector3<f64>,
    force: Vector3<f64>,
}

impl Motion {
    /// Integrates samples; those that are not finite, or not after the one before, are left out.
    pub fn new(samples: &[Sample], zero_ns: i64) -> Self {
        let mut motion = Self::default();
        let mut last: Option<(Point, Vector3<f64>)> = None;
        for (time_ns, rate, force) in samples {
            let time_s = time_ns.saturating_sub(zero_ns) as f64 * 1e-9;
            let is_finite = rate.iter().chain(force).all(|value| value.is_finite());
            if !is_finite || last.is_some_and(|(last, _)| last.time_s >= time_s) {
                continue;
            }
            let (turned, way, velocity, force) = match last {
                Some((point, last_rate)) => {
                    let dt = time_s - point.time_s;
                    if dt > LONGEST_S {
                        motion.breaks.push(time_s);
                    }
                    let turn = UnitQuaternion::from_scaled_axis(0.5 * (last_rate + rate) * dt);
                    let turned = point.inertial_from_body * turn;
                    let force = turned * force;
                    let mean = 0.5 * (point.force + force);
                    let way = point.way + point.velocity * dt + mean * (0.5 * dt * dt);
                    (turned, way, point.velocity + mean * dt, force)
                }
                None => (UnitQuaternion::identity(), Vector3::zeros(), Vector3::zeros(), *force),
            };
            let point = Point { time_s, inertial_from_body: turned, way, velocity, force };
            motion.points.push(point);
            last = Some((point, *rate));
        }
        motion
    }

    /// The point before a time, and the part of the way to the next; `None` outside of the samples.
    fn at(&self, time_s: f64) -> Option<(&Point, &Point, f64)> {
        let next = self.points.partition_point(|point| point.time_s <= time_s);
        let (before, after) = (self.points.get(next.checked_sub(1)?)?, self.points.get(next)?);
        Some((before, after, (time_s - before.time_s) / (after.time_s - before.time_s)))
    }

    /// Returns whether the motion over this time is known all along.
    pub fn is_whole(&self, from_s: f64, to_s: f64) -> bool {
        let next = self.breaks.partition_point(|time_s| *time_s < from_s);
        self.at(from_s).is_some()
            && self.at(to_s).is_some()
            && self.breaks.get(next).is_none_or(|time_s| *time_s > to_s)
    }

    /// The orientation at a time.
    pub fn turned(&self, time_s: f64) -> Option<UnitQuaternion<f64>> {
        let (before, after, part) = self.at(time_s)?;
        Some(before.inertial_from_body.nlerp(&after.inertial_from_body, part))
    }

    /// The way fallen and moved at a time.
    pub fn way(&self, time_s: f64) -> Option<Vector3<f64>> {
        let (before, _, _) = self.at(time_s)?;
        let dt = time_s - before.time_s;
        Some(before.way + before.velocity * dt + before.force * (0.5 * dt * dt))
    }
}
