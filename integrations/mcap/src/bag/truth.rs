//! The truth of a recording: optical orientation, and when the body moves.

use super::{Bag, BagMessages};
use crate::RecordingError;
use bb_core::nalgebra::UnitQuaternion;
use bb_core::payload::{Odometry, Pose};
use bb_core::{Payload, WallTime};

/// The type of a topic of poses.
pub const POSE: &str = "geometry_msgs/msg/PoseStamped";
/// Other type of a topic of poses, with velocities.
pub const ODOMETRY: &str = "nav_msgs/msg/Odometry";
/// The type of a topic that says whether the body moves.
pub const MOVING: &str = "std_msgs/msg/Bool";

/// `std_msgs/msg/Bool`
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Payload)]
#[payload(name = "std_msgs/Bool")]
pub struct Bool {
    /// The value.
    pub data: bool,
}

/// Poses farther apart are not interpolated.
const LONGEST_GAP_NS: i64 = 100_000_000;

/// The true orientation in a recording: poses (`geometry_msgs/PoseStamped`, or `nav_msgs/Odometry` if it is named),
/// and when the body moves (`std_msgs/Bool`, on change).
#[derive(Clone, Debug, Default)]
pub struct Truth {
    /// Poses by time; `None` where the markers were lost.
    poses: Vec<(i64, Option<UnitQuaternion<f64>>)>,
    /// Changes, by time; in a recording without them, the body counts as moving all the time.
    moving: Vec<(i64, bool)>,
}

impl Truth {
    /// Reads both, if the bag has exactly one topic of each type. Poses published by a robot of this project are not
    /// used: they are estimates.
    ///
    /// # Errors
    /// The bag is broken; says where.
    pub fn read(bag: &Bag) -> Result<Self, RecordingError> {
        let topics = [POSE, MOVING].iter().filter_map(|schema| bag.topic_of(schema).ok());
        let topics: Vec<_> = topics.filter(|topic| !topic.is_own).collect();
        let topics: Vec<_> = topics.iter().map(|topic| &topic.name).collect();
        let mut truth = Self::default();
        truth.extend(bag.messages(&topics)?)?;
        Ok(truth)
    }

    /// Adds poses and the times at which the body moves; other messages are ignored.
    ///
    /// # Errors
    /// The bag is damaged; says where. Data before that is kept.
    pub fn extend(&mut self, mut messages: BagMessages) -> Result<(), RecordingError> {
        let end = messages.try_for_each(|message| {
            let message = message?;
            match &*message.schema {
                POSE => {
                    let (pose, time) = message.payload::<Pose>()?;
                    self.push(time, &pose);
                }
                ODOMETRY => {
                    let (odometry, time) = message.payload::<Odometry>()?;
                    self.push(time, &odometry.pose);
                }
                // It has no header, so it has the recorder's time.
                MOVING => {
                    let Bool { data } = message.decode()?;
                    self.moving.push((i64::try_from(message.log_time_ns).unwrap_or(i64::MAX), data));
                }
                _ => {}
            }
            Ok(())
        });
        self.poses.sort_by_key(|(time, _)| *time);
        self.moving.sort_by_key(|(time, _)| *time);
        end
    }

    fn push(&mut self, time: WallTime, pose: &Pose) {
        let quaternion = pose.world_from_body.into_inner();
        let is_rotation = (quaternion.norm() - 1.0).abs() < 0.1;
        let rotation = is_rotation.then(|| UnitQuaternion::new_normalize(quaternion));
        self.poses.push((time.as_unix_nanos(), rotation));
    }

    /// Changes the truth to another frame of the body and another world: `world_from_old ⊗ truth ⊗ old_from_body`.
    pub fn turn(&mut self, world_from_old: &UnitQuaternion<f64>, old_from_body: &UnitQuaternion<f64>) {
        for rotation in self.poses.iter_mut().filter_map(|(_, rotation)| rotation.as_mut()) {
            *rotation = world_from_old * *rotation * old_from_body;
        }
    }

    /// Returns the time at which the body first moves, in nanoseconds; `None` if the recording does not say, or it never moves.
    pub fn first_motion(&self) -> Option<i64> {
        self.moving.iter().find(|(_, moving)| *moving).map(|(time, _)| *time)
    }

    /// Returns whether any orientation is known.
    pub fn is_known(&self) -> bool {
        self.poses.iter().any(|(_, pose)| pose.is_some())
    }

    /// The true orientation `world_from_body` at a time in nanoseconds since the Unix epoch, if it is known, and whether
    /// the body moves then (always, where the recording does not say). Between two poses at most 0.1 s apart it is
    /// interpolated.
    pub fn at(&self, time_ns: i64) -> (Option<UnitQuaternion<f64>>, bool) {
        let changed = self.moving.partition_point(|(time, _)| *time <= time_ns);
        let moving = match changed.checked_sub(1).and_then(|last| self.moving.get(last)) {
            Some((_, moving)) => *moving,
            None => self.moving.is_empty(),
        };
        (self.orientation(time_ns), moving)
    }

    fn orientation(&self, time_ns: i64) -> Option<UnitQuaternion<f64>> {
        let next = self.poses.partition_point(|(time, _)| *time < time_ns);
        let (after_ns, after) = *self.poses.get(next)?;
        if after_ns == time_ns {
            return after;
        }
        let (before_ns, before) = *self.poses.get(next.checked_sub(1)?)?;
        let gap_ns = after_ns - before_ns;
        let fraction = (time_ns - before_ns) as f64 / gap_ns as f64;
        (gap_ns <= LONGEST_GAP_NS).then(|| before?.try_slerp(&after?, fraction, 1e-9))?
    }
}
