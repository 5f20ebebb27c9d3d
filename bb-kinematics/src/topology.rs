//! Links, joints and the transforms between them, as constant data; their masses and appearance, as in URDF.

mod body;
mod transforms;
mod urdf;

pub use body::{Collision, Geometry, Inertial, Material, Visual};

use bb_message::message::Frame;
pub use bb_message::message::Transmission;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

/// The format of a graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GraphFormat {
    /// [Mermaid](https://mermaid.js.org), which Markdown viewers draw.
    Mermaid,
    /// Graphviz.
    Dot,
}

/// A robot's links and joints, in the order of their declaration; the first link is the root.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Topology {
    /// The links.
    pub links: &'static [Link],
    /// The joints.
    pub joints: &'static [Joint],
}

/// A rigid body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// Name of the link, and of its frame.
    pub name: &'static str,
    /// The number of the joint that carries it; `None` for the root.
    pub parent_joint: Option<usize>,
    /// Takes points from this link to the root, if all joints between are fixed.
    pub root_from_link: Option<Transform>,
    /// Mass and moments of inertia.
    pub inertial: Option<Inertial>,
    /// Shapes that viewers draw.
    pub visuals: &'static [Visual],
    /// Shapes for collision checks.
    pub collisions: &'static [Collision],
}

/// A connection between two links.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// Name.
    pub name: &'static str,
    /// Kind of motion.
    pub kind: JointKind,
    /// The number of the link it is mounted on.
    pub parent: usize,
    /// The number of the link that it carries.
    pub child: usize,
    /// Takes points from the joint's frame, which is the child's at rest, to the parent's.
    pub parent_from_joint: Origin,
    /// The axis of motion in the joint's frame, of unit length; for a planar joint the plane's normal.
    pub axis: Option<[f64; 3]>,
    /// Limits of position, velocity and effort.
    pub limit: Option<Limit>,
    /// Damping and friction.
    pub dynamics: Option<Dynamics>,
    /// The joint that it follows.
    pub mimic: Option<Mimic>,
    /// The transmission between it and its motor.
    pub transmission: Option<Transmission>,
}

/// Damping and friction of a joint: N·m·s/rad and N·m where it turns, N·s/m and N where it slides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dynamics {
    /// Viscous friction.
    pub damping: f64,
    /// Static friction.
    pub friction: f64,
}

/// A joint that follows another: `position = multiplier · other + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mimic {
    /// The number of the joint it follows.
    pub joint: usize,
    /// Motion for each unit of the other's.
    pub multiplier: f64,
    /// Position where the other's is 0; rad or m.
    pub offset: f64,
}

/// Kind of a joint's motion (URDF's types).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// No motion.
    Fixed,
    /// Turns about its axis between limits.
    Revolute,
    /// Turns about its axis without limits.
    Continuous,
    /// Slides along its axis between limits.
    Prismatic,
    /// Slides in the plane normal to its axis.
    Planar,
    /// Moves freely.
    Floating,
}

impl JointKind {
    /// Returns the name in URDF.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fixed => "fixed",
            Self::Revolute => "revolute",
            Self::Continuous => "continuous",
            Self::Prismatic => "prismatic",
            Self::Planar => "planar",
            Self::Floating => "floating",
        }
    }
}

/// The limits of a joint: rad, rad/s, N·m where it turns, m, m/s, N where it slides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    /// Smallest position.
    pub lower: Option<f64>,
    /// Largest position.
    pub upper: Option<f64>,
    /// Largest speed.
    pub velocity: Option<f64>,
    /// Largest torque or force.
    pub effort: Option<f64>,
}

/// A transform as URDF writes it: a translation, and angles about fixed axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Origin {
    /// Translation, m.
    pub xyz: [f64; 3],
    /// Angles in rad about the fixed axes x, y, z in this order: R = Rz(yaw) Ry(pitch) Rx(roll).
    pub rpy: [f64; 3],
}

impl Origin {
    /// No motion at all.
    pub const IDENTITY: Self = Self { xyz: [0.0; 3], rpy: [0.0; 3] };

    /// Returns the origin as an isometry.
    pub fn isometry(&self) -> Isometry3<f64> {
        let [roll, pitch, yaw] = self.rpy;
        let rotation = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
        Isometry3::from_parts(Translation3::from(Vector3::from(self.xyz)), rotation)
    }
}

/// A rotation and a translation as plain numbers, so that they can be constants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    /// Translation, m.
    pub translation: [f64; 3],
    /// Unit quaternion: w, x, y, z.
    pub rotation: [f64; 4],
}

impl Transform {
    /// No motion at all.
    pub const IDENTITY: Self = Self { translation: [0.0; 3], rotation: [1.0, 0.0, 0.0, 0.0] };

    /// Creates the transform of an isometry.
    pub fn of(isometry: &Isometry3<f64>) -> Self {
        let Quaternion { coords } = *isometry.rotation;
        Self { translation: isometry.translation.vector.into(), rotation: [coords.w, coords.x, coords.y, coords.z] }
    }

    /// Returns the transform as an isometry.
    pub fn isometry(&self) -> Isometry3<f64> {
        let [w, x, y, z] = self.rotation;
        let rotation = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
        Isometry3::from_parts(Translation3::from(Vector3::from(self.translation)), rotation)
    }
}

impl Topology {
    /// The root link's frame.
    pub fn root(&self) -> Frame {
        self.links.first().map_or(Frame::NONE, |link| Frame::new(link.name))
    }

    /// The link of that name.
    pub fn link(&self, name: &str) -> Option<&'static Link> {
        self.links.iter().find(|link| link.name == name)
    }

    /// The joint that a joint follows in the end, with the multiplier and the offset of its position: itself, 1 and 0
    /// if it mimics none.
    pub fn followed(&self, joint: usize) -> (usize, f64, f64) {
        let (mut owner, mut multiplier, mut offset) = (joint, 1.0, 0.0);
        // A cycle, which `robot!` rejects, must end too.
        for _ in self.joints {
            let Some(mimic) = self.joints.get(owner).and_then(|joint| joint.mimic) else { break };
            offset += multiplier * mimic.offset;
            multiplier *= mimic.multiplier;
            owner = mimic.joint;
        }
        (owner, multiplier, offset)
    }

    /// The path of a link: the joints and links from the root to it, `base/pan/head`.
    pub fn link_path(&self, link: &Link) -> String {
        match link.parent_joint.and_then(|joint| self.joints.get(joint)) {
            Some(joint) => format!("{}/{}", self.joint_path(joint), link.name),
            None => link.name.to_owned(),
        }
    }

    /// The path of a joint: the links and joints from the root to it, `base/pan`.
    pub fn joint_path(&self, joint: &Joint) -> String {
        let mut names = vec![joint.name];
        let mut link = self.links.get(joint.parent);
        // A declared robot is a tree. The loop terminates even if it is not.
        for _ in 0..=self.links.len() {
            let Some(at) = link else { break };
            names.push(at.name);
            let Some(carrier) = at.parent_joint.and_then(|number| self.joints.get(number)) else { break };
            names.push(carrier.name);
            link = self.links.get(carrier.parent);
        }
        names.reverse();
        names.join("/")
    }

    /// The number of the joint with that name or path.
    pub fn joint_number(&self, name_or_path: &str) -> Option<usize> {
        let mut joints = self.joints.iter();
        if name_or_path.contains('/') {
            return joints.position(|joint| self.joint_path(joint) == name_or_path);
        }
        joints.position(|joint| joint.name == name_or_path)
    }

    /// The joint of that name.
    pub fn joint(&self, name: &str) -> Option<&'static Joint> {
        self.joints.iter().find(|joint| joint.name == name)
    }
}
