//! The part of a trajectory for one joint.

use super::JointPoint;
use bb_core::Fault;
use bb_core::payload::JointTrajectory;

/// The part of a [`JointTrajectory`] that belongs to one joint, at any time since its start. Between two points it is
/// a polynomial: of fifth degree if both have velocities and accelerations, of third if both have velocities,
/// otherwise a straight line.
///
/// ```
/// use bb_core::payload::{JointTrajectory, TrajectoryPoint};
/// use bb_estimators::motion::JointPath;
/// use std::time::Duration;
///
/// let point = |position, seconds| TrajectoryPoint {
///     positions: vec![position],
///     time_from_start: Duration::from_secs(seconds),
///     ..TrajectoryPoint::default()
/// };
/// let trajectory =
///     JointTrajectory { joint_names: vec!["lift".to_owned()].into(), points: vec![point(0.0, 0), point(0.4, 2)].into() };
/// let lift = JointPath::of(&trajectory, "lift")?;
/// assert_eq!((lift.duration_s(), lift.at(1.0).position), (2.0, 0.2));
/// # Ok::<(), bb_core::Fault>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct JointPath {
    points: Vec<Knot>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Knot {
    time_s: f64,
    position: f64,
    velocity: Option<f64>,
    acceleration: Option<f64>,
}

impl JointPath {
    /// Creates the path of `joint`.
    ///
    /// # Errors
    /// The joint is not named, there are no points, a point lacks its position, or times do not increase.
    pub fn of(trajectory: &JointTrajectory, joint: &str) -> Result<Self, Fault> {
        let column = trajectory.joint_names.iter().position(|name| name == joint);
        let column =
            column.ok_or_else(|| Fault::new(format!("the trajectory does not name the joint `{joint}`")))?;
        let mut points: Vec<Knot> = Vec::with_capacity(trajectory.points.len());
        for point in trajectory.points.iter() {
            let time_s = point.time_from_start.as_secs_f64();
            let position = point.positions.get(column).copied();
            let position = position
                .ok_or_else(|| Fault::new(format!("the trajectory has no position of `{joint}` at {time_s} s")))?;
            if points.last().is_some_and(|last| last.time_s >= time_s) {
                return Err(Fault::new(format!("the times of the trajectory do not increase at {time_s} s")));
            }
            let velocity = point.velocities.get(column).copied();
            points.push(Knot {
                time_s,
                position,
                velocity,
                acceleration: point.accelerations.get(column).copied(),
            });
        }
        if points.is_empty() {
            return Err(Fault::new("the trajectory has no points"));
        }
        Ok(Self { points })
    }

    /// The time of the last point, s.
    pub fn duration_s(&self) -> f64 {
        self.points.last().map_or(0.0, |last| last.time_s)
    }

    /// The position at the end.
    pub fn target(&self) -> f64 {
        self.points.last().map_or(0.0, |last| last.position)
    }

    /// The largest speed of a point.
    pub fn speed(&self) -> f64 {
        self.points.iter().filter_map(|point| point.velocity).fold(0.0, |most, velocity| most.max(velocity.abs()))
    }

    /// The state of the joint `time_s` after the start. Before the first point, it is at that point; after the last,
    /// it rests there.
    pub fn at(&self, time_s: f64) -> JointPoint {
        let next = self.points.partition_point(|point| point.time_s <= time_s);
        let at_rest = |point: &Knot| JointPoint { position: point.position, ..JointPoint::default() };
        match (next.checked_sub(1).and_then(|before| self.points.get(before)), self.points.get(next)) {
            (Some(before), Some(after)) => between(before, after, time_s),
            (Some(only), None) | (None, Some(only)) => at_rest(only),
            (None, None) => JointPoint::default(),
        }
    }
}

/// Hermite interpolation.
fn between(before: &Knot, after: &Knot, time_s: f64) -> JointPoint {
    let (t, width) = (time_s - before.time_s, after.time_s - before.time_s);
    let rise = after.position - before.position;
    let (Some(v0), Some(v1)) = (before.velocity, after.velocity) else {
        let velocity = rise / width;
        return JointPoint { position: before.position + velocity * t, velocity, acceleration: 0.0 };
    };
    // p(t) = p₀ + v₀ t + c₂ t² + … ; the conditions at the other end determine the rest.
    let c = match (before.acceleration, after.acceleration) {
        (Some(a0), Some(a1)) => {
            let (h2, h3, h4, h5) = (width.powi(2), width.powi(3), width.powi(4), width.powi(5));
            [
                a0 / 2.0,
                (20.0 * rise - (8.0 * v1 + 12.0 * v0) * width - (3.0 * a0 - a1) * h2) / (2.0 * h3),
                (-30.0 * rise + (14.0 * v1 + 16.0 * v0) * width + (3.0 * a0 - 2.0 * a1) * h2) / (2.0 * h4),
                (12.0 * rise - 6.0 * (v1 + v0) * width + (a1 - a0) * h2) / (2.0 * h5),
            ]
        }
        _ => [
            (3.0 * rise - (2.0 * v0 + v1) * width) / width.powi(2),
            (-2.0 * rise + (v0 + v1) * width) / width.powi(3),
            0.0,
            0.0,
        ],
    };
    JointPoint {
        position: before.position + t * (v0 + t * (c[0] + t * (c[1] + t * (c[2] + t * c[3])))),
        velocity: v0 + t * (2.0 * c[0] + t * (3.0 * c[1] + t * (4.0 * c[2] + t * 5.0 * c[3]))),
        acceleration: 2.0 * c[0] + t * (6.0 * c[1] + t * (12.0 * c[2] + t * 20.0 * c[3])),
    }
}
