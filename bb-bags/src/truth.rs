//! The truth of a recording: optical orientation, and when the body moves.

use crate::{Bag, BagError, RosMessage};
use bb_core::nalgebra::{Quaternion, UnitQuaternion};

/// Beyond it nothing is said about the time between two poses.
const LONGEST_GAP_NS: i64 = 100_000_000;

/// What a recording knows of the true orientation: poses (`geometry_msgs/PoseStamped`), and when the body moves
/// (`std_msgs/Bool`, on change).
#[derive(Clone, Debug, Default)]
pub struct Truth {
    /// By time; none where the markers were lost.
    poses: Vec<(i64, Option<UnitQuaternion<f64>>)>,
    /// Changes, by time; a recording without them counts as moving all the time.
    moving: Vec<(i64, bool)>,
}

impl Truth {
    /// Reads both, where the bag has exactly one topic of their types.
    ///
    /// # Errors
    /// The bag is broken; says where.
    pub fn read(bag: &Bag) -> Result<Self, BagError> {
        let mut truth = Self { poses: Vec::new(), moving: Vec::new() };
        let wanted = ["geometry_msgs/msg/PoseStamped", "std_msgs/msg/Bool"];
        let topics: Vec<_> = wanted.iter().filter_map(|schema| bag.topic_of(schema).ok()).collect();
        if topics.is_empty() {
            return Ok(truth);
        }
        let topics: Vec<_> = topics.iter().map(|topic| &topic.name).collect();
        for message in bag.messages(&topics)? {
            let message = message?;
            match message.payload {
                RosMessage::PoseStamped(pose) => {
                    let q = pose.pose.orientation;
                    let quaternion = Quaternion::new(q.w, q.x, q.y, q.z);
                    let is_rotation = (quaternion.norm() - 1.0).abs() < 0.1;
                    let rotation = is_rotation.then(|| UnitQuaternion::new_normalize(quaternion));
                    truth.poses.push((pose.header.stamp.nanoseconds(), rotation));
                }
                // A Bool has no header: its time is the recorder's.
                RosMessage::Bool(moving) => {
                    truth.moving.push((i64::try_from(message.log_time_ns).unwrap_or(i64::MAX), moving.data));
                }
                _ => {}
            }
        }
        truth.poses.sort_by_key(|(time, _)| *time);
        truth.moving.sort_by_key(|(time, _)| *time);
        Ok(truth)
    }

    /// Whether any orientation is known.
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
