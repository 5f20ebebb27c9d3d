//! The kinematic tree: fixed joints are multiplied out, and each moving joint has its axis along z.

use super::KinematicsError;
use super::coordinates::{Coordinate, Motion, Owner};
use crate::topology::{Inertial, Joint, JointKind, Topology};
use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use std::ops::Range;

/// The kinematics of a robot, with the coordinates and frames of the [module](super).
///
/// ```
/// use bb_core::kinematics::Kinematics;
/// use bb_core::prelude::*;
///
/// robot! {
///     robot Crane;
///     link base {
///         joint slew: continuous {
///             axis: z;
///             link boom { joint end: fixed { origin: { xyz: [2 m, 0 m, 0 m] }; link hook; } }
///         }
///     }
/// }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let kinematics = Kinematics::new(Crane::TOPOLOGY)?;
/// let (base, hook) = (kinematics.link("base").ok_or("a link")?, kinematics.link("hook").ok_or("a link")?);
/// let base_from_hook = kinematics.chain(base, hook)?.transform(&[90_f64.to_radians()])?;
/// assert!((base_from_hook.translation.y - 2.0).abs() < 1e-12);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Kinematics {
    /// The bodies moved by joints, each after its parent.
    pub(super) bodies: Box<[Body]>,
    /// The placement of the links, in the order of the topology.
    pub(super) links: Box<[Placement]>,
    joints: Box<[(&'static str, JointCoordinates)]>,
    /// The smallest and largest position within the limits; infinite without a limit.
    pub(super) bounds: Box<[(f64, f64)]>,
    velocities: usize,
    /// The joints with coordinates of their own.
    owners: Box<[Owner]>,
}

/// A body: the child of one joint, with all links fixed to it. Its frame is that of the joint, rotated so that z is
/// its axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Body {
    /// The number of its parent body; `None` for the root.
    pub(super) parent: Option<usize>,
    /// Transforms points from the body at position zero to its parent.
    pub(super) parent_from_joint: Isometry3<f64>,
    pub(super) joint_from_parent: Isometry3<f64>,
    pub(super) motion: Motion,
}

/// The placement of a link.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placement {
    pub(super) name: &'static str,
    /// The body it belongs to; `None` for the root.
    pub(super) body: Option<usize>,
    pub(super) body_from_link: Isometry3<f64>,
    pub(super) inertial: Option<Inertial>,
}

/// A link of the robot whose [`Kinematics`] returned it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LinkId(pub(super) usize);

/// Coordinates of a joint. Both ranges are empty for a fixed joint; a joint that mimics another has that joint's.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct JointCoordinates {
    /// Indices into the positions.
    pub positions: Range<usize>,
    /// Indices into the velocities.
    pub velocities: Range<usize>,
}

impl Kinematics {
    /// Creates the kinematics of a robot, `Rover::TOPOLOGY`, or of links and joints from elsewhere.
    ///
    /// # Errors
    /// The links do not form a tree, a moving joint has no axis, its limits exclude each other, or it mimics a joint
    /// that it cannot follow. Robots that `robot!` declares have none of these errors.
    pub fn new(topology: &Topology) -> Result<Self, KinematicsError> {
        topology.joints.iter().try_for_each(check_limit)?;
        let (mut positions, mut velocities) = (0, 0);
        let (mut own, mut followed, mut owners) = (Vec::new(), Vec::new(), Vec::new());
        for (number, joint) in topology.joints.iter().enumerate() {
            let (q, v) = if joint.mimic.is_some() { (0, 0) } else { degrees(joint.kind) };
            if q > 0 {
                owners.push(Owner { kind: joint.kind, position: positions, velocity: velocities });
            }
            let (first, rate) = (positions, velocities);
            (positions, velocities) = (positions + q, velocities + v);
            own.push(JointCoordinates { positions: first..positions, velocities: rate..velocities });
            followed.push(follow(topology, number)?);
        }
        let mut carried_by = vec![None; topology.links.len()];
        for (number, joint) in topology.joints.iter().enumerate() {
            match carried_by.get_mut(joint.child) {
                Some(slot @ None) if joint.child != 0 => *slot = Some(number),
                _ => return Err(KinematicsError::TwoParents { link: link_name(topology, joint.child) }),
            }
        }
        let mut bodies = Vec::new();
        let mut placed: Vec<Option<(Option<usize>, Isometry3<f64>)>> = vec![None; topology.links.len()];
        if let Some(root) = placed.first_mut() {
            *root = Some((None, Isometry3::identity()));
        }
        // A link may be listed before its parent: each round places at least one more, or none can be placed.
        loop {
            let mut has_placed = false;
            for (link, carrier) in carried_by.iter().enumerate() {
                let Some(number) = *carrier else { continue };
                let joint = &topology.joints[number];
                let Some(Some((body, body_from_parent))) = placed.get(joint.parent).copied() else { continue };
                if placed[link].is_some() {
                    continue;
                }
                has_placed = true;
                let parent_from_joint = body_from_parent * joint.parent_from_joint.isometry();
                placed[link] = Some(match motion(joint, &own[followed[number].joint], &followed[number])? {
                    None => (body, parent_from_joint),
                    Some((motion, joint_from_axis)) => {
                        let parent_from_joint = parent_from_joint * joint_from_axis;
                        let joint_from_parent = parent_from_joint.inverse();
                        bodies.push(Body { parent: body, parent_from_joint, joint_from_parent, motion });
                        let axis_from_joint =
                            Isometry3::from_parts(Translation3::identity(), joint_from_axis.inverse());
                        (Some(bodies.len() - 1), axis_from_joint)
                    }
                });
            }
            if !has_placed {
                break;
            }
        }
        let mut links = Vec::new();
        for (link, placed) in topology.links.iter().zip(placed) {
            let (body, body_from_link) = placed.ok_or(KinematicsError::Unreachable { link: link.name })?;
            links.push(Placement { name: link.name, body, body_from_link, inertial: link.inertial });
        }
        let mut joints = Vec::new();
        for (joint, followed) in topology.joints.iter().zip(&followed) {
            joints.push((joint.name, own[followed.joint].clone()));
        }
        let bounds = bounds(topology, &own, &followed, positions);
        Ok(Self {
            bodies: bodies.into(),
            links: links.into(),
            joints: joints.into(),
            bounds,
            velocities,
            owners: owners.into(),
        })
    }

    /// The length of a position.
    pub fn positions(&self) -> usize {
        self.bounds.len()
    }

    /// The length of a velocity.
    pub fn velocities(&self) -> usize {
        self.velocities
    }

    /// The link of that name.
    pub fn link(&self, name: &str) -> Option<LinkId> {
        self.links.iter().position(|link| link.name == name).map(LinkId)
    }

    /// The coordinates of the joint of that name.
    pub fn joint(&self, name: &str) -> Option<&JointCoordinates> {
        self.joints.iter().find(|(joint, _)| *joint == name).map(|(_, coordinates)| coordinates)
    }

    /// The smallest and largest value of each element of a position; infinite where the joint has no limit. The
    /// limits of a joint that mimics another apply to that one.
    pub fn bounds(&self) -> &[(f64, f64)] {
        &self.bounds
    }

    /// The position in which every joint is at zero, or as near to zero as its limits allow.
    pub fn neutral(&self) -> Vec<f64> {
        let mut position: Vec<f64> =
            self.bounds.iter().map(|(lower, upper)| lower.max(0.0_f64.min(*upper))).collect();
        for body in &self.bodies {
            if let Motion::Free { position: first, .. } = body.motion {
                position[first + 3] = 1.0;
            }
        }
        position
    }

    /// Moves a position by a constant `velocity` for `duration_s`, in the axes of the child for planar and floating
    /// joints. Limits are not applied.
    ///
    /// # Errors
    /// The number of positions or velocities is not that of the robot.
    pub fn integrate(
        &self,
        position: &mut [f64],
        velocity: &[f64],
        duration_s: f64,
    ) -> Result<(), KinematicsError> {
        self.check_positions(position)?;
        self.check_velocities("velocities", velocity)?;
        for owner in &self.owners {
            owner.integrate(position, velocity, duration_s);
        }
        Ok(())
    }

    pub(super) fn owners(&self) -> &[Owner] {
        &self.owners
    }

    pub(super) fn placement(&self, link: LinkId) -> Result<&Placement, KinematicsError> {
        self.links.get(link.0).ok_or_else(|| KinematicsError::NoLink(format!("number {}", link.0)))
    }

    pub(super) fn check_positions(&self, given: &[f64]) -> Result<(), KinematicsError> {
        check("positions", self.positions(), given)
    }

    pub(super) fn check_velocities(&self, what: &'static str, given: &[f64]) -> Result<(), KinematicsError> {
        check(what, self.velocities, given)
    }
}

pub(super) fn check(what: &'static str, expected: usize, given: &[f64]) -> Result<(), KinematicsError> {
    let given = given.len();
    if given == expected { Ok(()) } else { Err(KinematicsError::Coordinates { what, expected, given }) }
}

fn check_limit(joint: &Joint) -> Result<(), KinematicsError> {
    let Some(limit) = joint.limit else { return Ok(()) };
    let values = [limit.lower, limit.upper, limit.velocity, limit.effort];
    let is_nan = values.into_iter().flatten().any(f64::is_nan);
    let excludes = matches!((limit.lower, limit.upper), (Some(lower), Some(upper)) if lower > upper);
    if is_nan || excludes { Err(KinematicsError::Limit { joint: joint.name }) } else { Ok(()) }
}

fn link_name(topology: &Topology, number: usize) -> &'static str {
    topology.links.get(number).map_or("", |link| link.name)
}

/// The lengths of a joint's position and velocity.
const fn degrees(kind: JointKind) -> (usize, usize) {
    match kind {
        JointKind::Fixed => (0, 0),
        JointKind::Revolute | JointKind::Continuous | JointKind::Prismatic => (1, 1),
        JointKind::Planar => (3, 3),
        JointKind::Floating => (7, 6),
    }
}

/// The joint whose coordinates a joint follows in the end, with multiplier and offset.
#[derive(Clone, Copy, Debug)]
struct Followed {
    joint: usize,
    multiplier: f64,
    offset: f64,
}

fn follow(topology: &Topology, joint: usize) -> Result<Followed, KinematicsError> {
    let mut followed = Followed { joint, multiplier: 1.0, offset: 0.0 };
    for _ in 0..=topology.joints.len() {
        let Some(Joint { mimic, kind, .. }) = topology.joints.get(followed.joint) else { break };
        let Some(mimic) = mimic else {
            let is_direct = followed.joint == joint;
            if is_direct || degrees(*kind).0 == 1 {
                return Ok(followed);
            }
            break;
        };
        // x = m (m' y + o') + o
        followed.offset += followed.multiplier * mimic.offset;
        followed.multiplier *= mimic.multiplier;
        followed.joint = mimic.joint;
    }
    let joint = topology.joints.get(joint).map_or("", |joint| joint.name);
    Err(KinematicsError::Mimic { joint })
}

/// Returns the motion of a joint, and the rotation from the frame in which its axis is z to its own; `None` for a fixed one.
fn motion(
    joint: &Joint,
    coordinates: &JointCoordinates,
    followed: &Followed,
) -> Result<Option<(Motion, UnitQuaternion<f64>)>, KinematicsError> {
    let (position, velocity) = (coordinates.positions.start, coordinates.velocities.start);
    let coordinate = Coordinate { position, velocity, multiplier: followed.multiplier, offset: followed.offset };
    let motion = match joint.kind {
        JointKind::Fixed => return Ok(None),
        JointKind::Floating if joint.mimic.is_none() => {
            return Ok(Some((Motion::Free { position, velocity }, UnitQuaternion::identity())));
        }
        JointKind::Planar if joint.mimic.is_none() => Motion::Plane { position, velocity },
        JointKind::Floating | JointKind::Planar => return Err(KinematicsError::Mimic { joint: joint.name }),
        JointKind::Revolute | JointKind::Continuous => Motion::Turn(coordinate),
        JointKind::Prismatic => Motion::Slide(coordinate),
    };
    let axis = joint.axis.map(Vector3::from).and_then(|axis| Unit::try_new(axis, 1e-9));
    let axis = axis.filter(|axis| axis.iter().all(|part| part.is_finite()));
    let axis = axis.ok_or(KinematicsError::NoAxis { joint: joint.name })?;
    // For opposite axes the shortest rotation is not unique: take half a turn about x.
    let joint_from_axis = UnitQuaternion::rotation_between_axis(&Vector3::z_axis(), &axis)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
    Ok(Some((motion, joint_from_axis)))
}

fn bounds(
    topology: &Topology,
    own: &[JointCoordinates],
    followed: &[Followed],
    positions: usize,
) -> Box<[(f64, f64)]> {
    let mut bounds = vec![(f64::NEG_INFINITY, f64::INFINITY); positions];
    for (joint, followed) in topology.joints.iter().zip(followed) {
        let is_bounded = matches!(joint.kind, JointKind::Revolute | JointKind::Prismatic);
        let (Some(limit), true) = (joint.limit, is_bounded && followed.multiplier != 0.0) else { continue };
        let Some(bound) = own.get(followed.joint).and_then(|own| bounds.get_mut(own.positions.start)) else {
            continue;
        };
        let of = |value: f64| (value - followed.offset) / followed.multiplier;
        let (mut lower, mut upper) = (limit.lower.map(of), limit.upper.map(of));
        if followed.multiplier < 0.0 {
            std::mem::swap(&mut lower, &mut upper);
        }
        bound.0 = lower.map_or(bound.0, |lower| bound.0.max(lower));
        bound.1 = upper.map_or(bound.1, |upper| bound.1.min(upper));
    }
    bounds.into()
}
