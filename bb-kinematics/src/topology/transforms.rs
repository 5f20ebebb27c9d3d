//! The frames of a robot as ROS transform messages.

use super::{Joint, JointKind, Topology};
use bb_message::message::codec::ros::{Header, Time, TransformStamped, TransformsMessage};
use bb_message::time::WallTime;
use nalgebra::{Isometry3, Quaternion, Translation3, Unit, UnitQuaternion, Vector3};

impl Topology {
    /// The fixed transforms: the frame of each joint relative to its parent link, and of each fixed joint's child
    /// link relative to the joint.
    pub fn fixed_transforms(&self, time: WallTime) -> TransformsMessage {
        let name = |link: usize| self.links.get(link).map_or("", |link| link.name);
        let transforms = self.joints.iter().filter_map(|joint| {
            let child = match joint.kind {
                // A fixed joint carries the link itself; nothing is measured in its frame.
                JointKind::Fixed => name(joint.child),
                // There is one frame of that name, and it moves.
                _ if joint.name == name(joint.child) => return None,
                _ => joint.name,
            };
            Some(transform(time, name(joint.parent), child, joint.parent_from_joint.isometry()))
        });
        TransformsMessage { transforms: transforms.collect() }
    }

    /// The transforms of these joints, if they move, with the position of each in the coordinates of
    /// [`kinematics`](crate::kinematics#coordinates); empty for a joint at rest.
    pub fn moving_transforms(
        &self,
        joints: impl IntoIterator<Item = (usize, impl AsRef<[f64]>)>,
        time: WallTime,
    ) -> TransformsMessage {
        let name = |link: usize| self.links.get(link).map_or("", |link| link.name);
        let transforms = joints.into_iter().filter_map(|(number, position)| {
            let joint = self.joints.get(number).filter(|joint| joint.kind != JointKind::Fixed)?;
            let motion = joint.motion(position.as_ref());
            Some(match joint.name == name(joint.child) {
                true => {
                    transform(time, name(joint.parent), joint.name, joint.parent_from_joint.isometry() * motion)
                }
                false => transform(time, joint.name, name(joint.child), motion),
            })
        });
        TransformsMessage { transforms: transforms.collect() }
    }
}

impl Joint {
    /// Transforms points from the link that the joint carries to the joint's frame, at a position in the coordinates
    /// of [`kinematics`](crate::kinematics#coordinates). At rest if the position has the wrong length.
    pub fn motion(&self, position: &[f64]) -> Isometry3<f64> {
        let axis = Vector3::from(self.axis.unwrap_or([1.0, 0.0, 0.0]));
        match (self.kind, position) {
            (JointKind::Revolute | JointKind::Continuous, [angle]) => {
                let turn = UnitQuaternion::from_axis_angle(&Unit::new_normalize(axis), *angle);
                Isometry3::from_parts(Translation3::identity(), turn)
            }
            (JointKind::Prismatic, [length]) => Translation3::from(axis * *length).into(),
            (JointKind::Planar, [x, y, angle]) => {
                let axis = Unit::new_normalize(axis);
                // Same convention as the kinematics if the axis is opposite to z.
                let joint_from_plane = UnitQuaternion::rotation_between_axis(&Vector3::z_axis(), &axis)
                    .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
                let moved = joint_from_plane * Vector3::new(*x, *y, 0.0);
                Isometry3::from_parts(moved.into(), UnitQuaternion::from_axis_angle(&axis, *angle))
            }
            (JointKind::Floating, [x, y, z, w, i, j, k]) => {
                let rotation = UnitQuaternion::new_normalize(Quaternion::new(*w, *i, *j, *k));
                Isometry3::from_parts(Translation3::new(*x, *y, *z), rotation)
            }
            _ => Isometry3::identity(),
        }
    }
}

fn transform(time: WallTime, parent: &str, child: &str, transform: Isometry3<f64>) -> TransformStamped {
    let header = Header { stamp: Time::of(time), frame_id: parent.to_owned() };
    TransformStamped { header, child_frame_id: child.to_owned(), transform }
}
