//! The robot's frames, on the topics where viewers expect them: `/tf_static` and `/tf`.

use bb_core::message::codec::ros::{Header, Time, TransformStamped, TransformsMessage, WORLD};
use bb_core::nalgebra::{Isometry3, UnitQuaternion, Vector3};
use bb_core::payload::{Odometry, Orientation, Pose, PoseWithCovariance};
use bb_core::topology::Topology;
use bb_core::{DynamicMessage, JointSide};

/// The state of the frames from the messages so far.
#[derive(Debug)]
pub(super) struct Frames {
    topology: &'static Topology,
    /// The path that places the robot, and whether it includes a position.
    body: Option<(String, BodyContent)>,
}

/// State of a body that a path holds, in increasing order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum BodyContent {
    Orientation,
    Pose,
    /// Chosen explicitly, whatever it contains.
    Chosen,
}

impl Frames {
    /// Creates the frames of a robot placed by `body`, or otherwise by the path that says the most, the first of several.
    pub(super) fn new(topology: &'static Topology, body: Option<String>) -> Self {
        Self { topology, body: body.map(|path| (path, BodyContent::Chosen)) }
    }

    /// All moving joints, at rest: their positions until a message reports others.
    pub(super) fn at_rest(&self) -> impl Iterator<Item = (usize, Vec<f64>)> + '_ {
        let joints = self.topology.joints.iter().enumerate();
        joints.map(|(number, _)| match self.topology.followed(number) {
            (owner, ..) if owner == number => (number, Vec::new()),
            (_, _, offset) => (number, vec![offset]),
        })
    }

    /// The transforms reported by a message.
    pub(super) fn transforms(&mut self, message: &DynamicMessage) -> TransformsMessage {
        let stamp = message.stamp();
        let joints = self.joints(message);
        if !joints.is_empty() {
            return TransformsMessage::moving(self.topology, self.moved(&joints), stamp.wall_time);
        }
        let Some((content, world_from_body)) = place(message) else { return NONE };
        let at = |child: &str| TransformStamped {
            header: Header { stamp: Time::of(stamp.wall_time), frame_id: WORLD.to_owned() },
            child_frame_id: child.to_owned(),
            transform: world_from_body,
        };
        // The frame of a link has one parent, its joint's; an estimate of its pose gets its own frame.
        let mut transforms = vec![at(message.path())];
        if let Some(root) = self.topology.links.first()
            && root.name == stamp.frame.name()
            && self.places_the_body(message.path(), content)
        {
            transforms.push(at(root.name));
        }
        TransformsMessage { transforms }
    }

    fn places_the_body(&mut self, path: &str, content: BodyContent) -> bool {
        match &self.body {
            Some((known, _)) if known == path => true,
            Some((_, known)) if *known >= content => false,
            _ => {
                self.body = Some((path.to_owned(), content));
                true
            }
        }
    }

    /// The joints whose positions a message reports, and these positions.
    fn joints(&self, message: &DynamicMessage) -> Vec<(usize, Vec<f64>)> {
        let mut positions = Vec::new();
        let stamp = message.stamp();
        message.tell_joints(&mut |reading| {
            let name = reading.joint.unwrap_or_else(|| stamp.frame.name());
            let Some(number) = self.topology.joint_number(name) else { return };
            let Some(joint) = self.topology.joints.get(number) else { return };
            let gear = joint.transmission.filter(|_| reading.side == JointSide::Motor);
            let position: Vec<f64> = match (gear, reading.position) {
                (Some(gear), [motor]) => vec![gear.joint_position(*motor)],
                (_, position) => position.to_vec(),
            };
            if position.iter().all(|value| value.is_finite()) {
                positions.push((number, position));
            }
        });
        positions
    }

    /// Returns these joints, and those that follow them.
    fn moved(&self, positions: &[(usize, Vec<f64>)]) -> Vec<(usize, Vec<f64>)> {
        let position = |number: usize| positions.iter().find(|(joint, _)| *joint == number).map(|(_, at)| at);
        let moved = (0..self.topology.joints.len()).filter_map(|number| {
            let (owner, multiplier, offset) = self.topology.followed(number);
            let follows = || match position(owner)?.as_slice() {
                [at] if owner != number => Some(vec![multiplier * at + offset]),
                _ => None,
            };
            Some((number, position(number).cloned().or_else(follows)?))
        });
        moved.collect()
    }
}

const NONE: TransformsMessage = TransformsMessage { transforms: Vec::new() };

/// The pose of a body from an estimate; `None` if the message is not an estimate of a pose, or is not finite.
fn place(message: &DynamicMessage) -> Option<(BodyContent, Isometry3<f64>)> {
    let at = |position: Vector3<f64>, rotation: UnitQuaternion<f64>| {
        let is_place = position.iter().all(|value| value.is_finite()) && (rotation.norm() - 1.0).abs() < 0.1;
        is_place
            .then(|| Isometry3::from_parts(position.into(), UnitQuaternion::new_normalize(rotation.into_inner())))
    };
    if let Some(orientation) = message.downcast::<Orientation>() {
        return Some((BodyContent::Orientation, at(Vector3::zeros(), orientation.world_from_body)?));
    }
    let (position, rotation) = if let Some(pose) = message.downcast::<Pose>() {
        (pose.position, pose.world_from_body)
    } else if let Some(pose) = message.downcast::<PoseWithCovariance>() {
        (pose.position, pose.world_from_body)
    } else {
        let Odometry { pose, .. } = message.downcast::<Odometry>()?.payload;
        (pose.position, pose.world_from_body)
    };
    Some((BodyContent::Pose, at(position, rotation)?))
}
