//! The channels that viewers of ROS expect of every robot, beside one for each topic, and their messages.

use crate::message::JointSide;
use crate::message::codec::ros::{Header, Text, Time, TransformStamped, TransformsMessage, WORLD};
use crate::message::codec::{Field, Schema, Shape, encode, type_hash};
use crate::payload::{Odometry, Orientation, Pose, PoseWithCovariance};
use crate::pubsub::DynamicMessage;
use crate::time::WallTime;
use crate::topology::Topology;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

/// A channel that viewers expect, with messages in ROS's layout that no component publishes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ViewerChannel {
    /// The robot as URDF.
    RobotDescription,
    /// The transforms of fixed joints, and where the others are mounted.
    FixedTransforms,
    /// The transforms of moving joints, and estimates of poses.
    Transforms,
}

impl ViewerChannel {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::RobotDescription, Self::FixedTransforms, Self::Transforms];

    /// Returns the topic in ROS: `/tf`.
    pub const fn topic(self) -> &'static str {
        match self {
            Self::RobotDescription => "/robot_description",
            Self::FixedTransforms => "/tf_static",
            Self::Transforms => "/tf",
        }
    }

    /// Returns whether those who subscribe late get the last message: `transient_local` in ROS.
    pub const fn is_latched(self) -> bool {
        !matches!(self, Self::Transforms)
    }

    /// The definition of its messages.
    pub fn schema(self) -> Schema {
        Schema::new(self.name(), self.shape())
    }

    /// The [`type_hash`] of its messages.
    pub fn type_hash(self) -> String {
        type_hash(self.name(), self.shape())
    }

    fn name(self) -> &'static str {
        if let Shape::Struct(shape) = self.shape() { shape.name } else { "" }
    }

    const fn shape(self) -> Shape {
        match self {
            Self::RobotDescription => Text::SHAPE,
            Self::FixedTransforms | Self::Transforms => TransformsMessage::SHAPE,
        }
    }
}

/// A message of a [`ViewerChannel`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ViewerMessage {
    /// Channel.
    pub channel: ViewerChannel,
    /// Contents, as CDR.
    pub bytes: Vec<u8>,
}

/// The messages of the [`ViewerChannel`]s of one robot: for recordings, and for bridges to viewers.
///
/// ```
/// use bb_core::joints::{ViewerChannel, ViewerMessages};
/// use bb_core::prelude::*;
///
/// robot! { robot Rig; link base { sensor imu: External<Orientation>(); } }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let rig = Rig::builder().simulate()?;
/// let mut viewers = ViewerMessages::new("Rig", rig.topology(), None);
/// let topics: Vec<_> = viewers.first(WallTime::default()).iter().map(|message| message.channel.topic()).collect();
/// assert_eq!(topics, ["/robot_description", "/tf_static"]);
/// let all = rig.subscribe_any(Select::All, None, Overflow::default());
/// let level = Orientation { world_from_body: Default::default(), covariance: None };
/// rig.publisher("sensor/base/imu")?.publish(level);
/// let seen = all.try_recv().and_then(|message| viewers.following(&message)).expect("an orientation is a transform");
/// assert_eq!(seen.channel, ViewerChannel::Transforms);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct ViewerMessages {
    urdf: String,
    frames: Frames,
}

impl ViewerMessages {
    /// Creates the messages of a robot of that name, placed in the frame `world` by the path `body`, or otherwise by the path that says the most of its root
    /// link, the first of several.
    pub fn new(robot: &str, topology: &'static Topology, body: Option<String>) -> Self {
        Self { urdf: topology.to_urdf(robot), frames: Frames::new(topology, body) }
    }

    /// The robot as URDF.
    pub fn urdf(&self) -> &str {
        &self.urdf
    }

    /// The messages that a viewer needs before others: the latched ones, and the joints at rest if there are any that move.
    pub fn first(&self, time: WallTime) -> Vec<ViewerMessage> {
        let description = message(ViewerChannel::RobotDescription, &Text { data: self.urdf.clone() });
        let fixed = self.frames.topology.fixed_transforms(time);
        let fixed = message(ViewerChannel::FixedTransforms, &fixed);
        let at_rest = self.frames.topology.moving_transforms(self.frames.at_rest(), time);
        [description, fixed].into_iter().chain(transforms(&at_rest)).collect()
    }

    /// The transforms that follow from a message, if any do.
    pub fn following(&mut self, message: &DynamicMessage) -> Option<ViewerMessage> {
        transforms(&self.frames.transforms(message))
    }
}

fn message<T: Field>(channel: ViewerChannel, message: &T) -> ViewerMessage {
    let mut bytes = Vec::new();
    encode(message, &mut bytes);
    ViewerMessage { channel, bytes }
}

fn transforms(of: &TransformsMessage) -> Option<ViewerMessage> {
    (!of.transforms.is_empty()).then(|| message(ViewerChannel::Transforms, of))
}

/// The state of the frames from the messages so far.
#[derive(Debug)]
struct Frames {
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
    fn new(topology: &'static Topology, body: Option<String>) -> Self {
        Self { topology, body: body.map(|path| (path, BodyContent::Chosen)) }
    }

    /// All moving joints, at rest: their positions until a message reports others.
    fn at_rest(&self) -> impl Iterator<Item = (usize, Vec<f64>)> + '_ {
        let joints = self.topology.joints.iter().enumerate();
        joints.map(|(number, _)| match self.topology.followed(number) {
            (owner, ..) if owner == number => (number, Vec::new()),
            (_, _, offset) => (number, vec![offset]),
        })
    }

    /// The transforms reported by a message.
    fn transforms(&mut self, message: &DynamicMessage) -> TransformsMessage {
        let stamp = message.stamp();
        let joints = self.joints(message);
        if !joints.is_empty() {
            return self.topology.moving_transforms(self.moved(&joints), stamp.wall_time);
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
