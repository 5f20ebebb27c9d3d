//! Where the frames of the robot are, on the topics where viewers expect that: `/tf_static` and `/tf`.

use bb_core::DynamicMessage;
use bb_core::message::codec::ros::{Header, Time, TransformStamped, TransformsMessage, WORLD};
use bb_core::nalgebra::{Isometry3, UnitQuaternion, Vector3};
use bb_core::payload::{JointState, JointStates, Odometry, Orientation, Pose, PoseWithCovariance};
use bb_core::topology::Topology;

/// What is known of the frames from the messages so far.
#[derive(Debug)]
pub(super) struct Frames {
    topology: &'static Topology,
    /// The path that tells where the robot is, and whether it tells a position.
    body: Option<(String, Told)>,
}

/// How much a path tells of a body; the more, the greater.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Told {
    Orientation,
    Pose,
    /// Whatever it is, it was chosen.
    Chosen,
}

impl Frames {
    /// Of a robot whose place is told by `body`, or else by the path that tells the most, the first of several.
    pub(super) fn new(topology: &'static Topology, body: Option<String>) -> Self {
        Self { topology, body: body.map(|path| (path, Told::Chosen)) }
    }

    /// All joints that move, at rest: where they are until a message says otherwise.
    pub(super) fn at_rest(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        let joints = self.topology.joints.iter().enumerate();
        joints.map(|(number, joint)| (number, joint.mimic.map_or(0.0, |mimic| mimic.offset)))
    }

    /// The transforms that a message tells.
    pub(super) fn told(&mut self, message: &DynamicMessage) -> TransformsMessage {
        let stamp = message.stamp();
        if let Some(state) = message.downcast::<JointState>() {
            return self.joints(message, &[(stamp.frame.name(), state.position)]);
        }
        if let Some(states) = message.downcast::<JointStates>() {
            let states: Vec<_> =
                states.names.iter().map(String::as_str).zip(states.positions.iter().copied()).collect();
            return self.joints(message, &states);
        }
        let Some((told, world_from_body)) = place(message) else { return NONE };
        let at = |child: &str| TransformStamped {
            header: Header { stamp: Time::of(stamp.wall_time), frame_id: WORLD.to_owned() },
            child_frame_id: child.to_owned(),
            transform: world_from_body,
        };
        // The frame of a link has one parent, its joint's; an estimate of where it is has a frame of its own.
        let mut transforms = vec![at(message.path())];
        if let Some(root) = self.topology.links.first()
            && root.name == stamp.frame.name()
            && self.tells_of_the_body(message.path(), told)
        {
            transforms.push(at(root.name));
        }
        TransformsMessage { transforms }
    }

    fn tells_of_the_body(&mut self, path: &str, told: Told) -> bool {
        match &self.body {
            Some((known, _)) if known == path => true,
            Some((_, known)) if *known >= told => false,
            _ => {
                self.body = Some((path.to_owned(), told));
                true
            }
        }
    }

    /// The joints that are named, and those that follow them.
    fn joints(&self, message: &DynamicMessage, states: &[(&str, f64)]) -> TransformsMessage {
        let position = |number: usize| {
            let joint = self.topology.joints.get(number)?;
            states.iter().find(|(name, position)| *name == joint.name && position.is_finite()).map(|(_, at)| *at)
        };
        let moved = self.topology.joints.iter().enumerate().filter_map(|(number, joint)| {
            let follows =
                || joint.mimic.and_then(|mimic| Some(mimic.multiplier * position(mimic.joint)? + mimic.offset));
            Some((number, position(number).or_else(follows)?))
        });
        TransformsMessage::moving(self.topology, moved, message.stamp().wall_time)
    }
}

const NONE: TransformsMessage = TransformsMessage { transforms: Vec::new() };

/// Where a body is by an estimate of it; none if the message is not an estimate of a pose, or is not finite.
fn place(message: &DynamicMessage) -> Option<(Told, Isometry3<f64>)> {
    let at = |position: Vector3<f64>, rotation: UnitQuaternion<f64>| {
        let is_place = position.iter().all(|value| value.is_finite()) && (rotation.norm() - 1.0).abs() < 0.1;
        is_place
            .then(|| Isometry3::from_parts(position.into(), UnitQuaternion::new_normalize(rotation.into_inner())))
    };
    if let Some(orientation) = message.downcast::<Orientation>() {
        return Some((Told::Orientation, at(Vector3::zeros(), orientation.world_from_body)?));
    }
    let (position, rotation) = if let Some(pose) = message.downcast::<Pose>() {
        (pose.position, pose.world_from_body)
    } else if let Some(pose) = message.downcast::<PoseWithCovariance>() {
        (pose.position, pose.world_from_body)
    } else {
        let Odometry { pose, .. } = message.downcast::<Odometry>()?.payload;
        (pose.position, pose.world_from_body)
    };
    Some((Told::Pose, at(position, rotation)?))
}
