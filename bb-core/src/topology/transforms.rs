//! The frames of a robot as ROS's message of transforms.

use super::{JointKind, Topology};
use crate::message::codec::ros::{Header, Time, TransformStamped, TransformsMessage};
use crate::time::WallTime;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

impl TransformsMessage {
    /// Where the links and joints of a robot are when every joint is at rest: the frame of a joint in that of the link it
    /// is mounted on, and that of the link it carries in the joint's. What a joint that moves carries is placed as if
    /// it were at rest.
    pub fn at_rest(topology: &Topology, time: WallTime) -> Self {
        let stamp = Time::of(time);
        let name = |link: usize| topology.links.get(link).map_or("", |link| link.name);
        let mut transforms = Vec::new();
        for joint in topology.joints {
            let at_joint = joint.parent_from_joint.isometry();
            let mut place = |parent: &str, child: &str, transform: Isometry3<f64>| {
                let header = Header { stamp, frame_id: parent.to_owned() };
                transforms.push(TransformStamped { header, child_frame_id: child.to_owned(), transform });
            };
            // A fixed joint carries the link itself; nothing is measured in its frame.
            if joint.kind == JointKind::Fixed || joint.name == name(joint.child) {
                place(name(joint.parent), name(joint.child), at_joint);
            } else {
                place(name(joint.parent), joint.name, at_joint);
                let unmoved = Isometry3::from_parts(Vector3::zeros().into(), UnitQuaternion::identity());
                place(joint.name, name(joint.child), unmoved);
            }
        }
        Self { transforms }
    }
}
