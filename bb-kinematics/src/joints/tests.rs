//! Random robots: a lookup by handle agrees with the kinematics of the whole robot.

use super::*;
use crate::kinematics::{Frames, Kinematics};
use crate::topology::{Joint, JointKind, Link, Mimic, Origin, Topology};
use bb_message::__private::Sorted;
use bb_message::message::{Frame, JointPositions, JointReading, Payload, Stamp, Stamped};
use bb_message::time::{Clock, MonotonicTime};
use bb_tests::laws;
use nalgebra::{Isometry3, Vector3};
use proptest::prelude::*;

/// A position of a joint of any kind.
#[derive(Clone, Debug, Payload)]
#[payload(joint_position)]
struct Placed {
    joint: String,
    position: Vec<f64>,
}

impl JointPositions for Placed {
    fn tell(&self, listener: &mut dyn FnMut(JointReading<'_>)) {
        listener(JointReading::at(&self.position).of(&self.joint));
    }
}

/// Kind, parent, origin, axis, and the joint that it mimics, if possible.
type Drawn = (usize, prop::sample::Index, [f64; 6], [f64; 3], Option<(prop::sample::Index, f64, f64)>);

fn topology(drawn: &[Drawn]) -> Topology {
    const KINDS: [JointKind; 6] = [
        JointKind::Fixed,
        JointKind::Revolute,
        JointKind::Continuous,
        JointKind::Prismatic,
        JointKind::Planar,
        JointKind::Floating,
    ];
    let name =
        |what: &str, number: usize| -> &'static str { Box::leak(format!("{what}{number}").into_boxed_str()) };
    let mut joints: Vec<Joint> = Vec::new();
    for (number, (kind, parent, [x, y, z, roll, pitch, yaw], axis, mimic)) in drawn.iter().enumerate() {
        let kind = KINDS[*kind];
        let is_single = |kind| matches!(kind, JointKind::Revolute | JointKind::Continuous | JointKind::Prismatic);
        let leaders: Vec<usize> = (0..number).filter(|other| is_single(joints[*other].kind)).collect();
        let mimic = mimic.filter(|_| is_single(kind) && !leaders.is_empty());
        joints.push(Joint {
            name: name("joint", number),
            kind,
            parent: parent.index(number + 1),
            child: number + 1,
            parent_from_joint: Origin { xyz: [*x, *y, *z], rpy: [*roll, *pitch, *yaw] },
            axis: Some(Vector3::from(*axis).normalize().into()),
            limit: None,
            dynamics: None,
            mimic: mimic.map(|(joint, multiplier, offset)| Mimic {
                joint: *joint.get(&leaders),
                multiplier,
                offset,
            }),
            transmission: None,
        });
    }
    let links = (0..=drawn.len()).map(|number| Link {
        name: name("link", number),
        parent_joint: number.checked_sub(1),
        root_from_link: None,
        inertial: None,
        visuals: &[],
        collisions: &[],
    });
    Topology { links: links.collect::<Vec<_>>().leak(), joints: joints.leak() }
}

fn drawn() -> impl Strategy<Value = Vec<Drawn>> {
    let axis = prop::array::uniform3(-1.0..1.0_f64)
        .prop_filter("a direction", |axis| axis.iter().map(|part| part * part).sum::<f64>() > 0.01);
    let mimic = prop::option::weighted(0.3, (any::<prop::sample::Index>(), -2.0..2.0_f64, -1.0..1.0_f64));
    let joint = (0..6_usize, any::<prop::sample::Index>(), prop::array::uniform6(-2.0..2.0_f64), axis, mimic);
    proptest::collection::vec(joint, 1..10)
}

laws! {
    #[test]
    fn a_handle_finds_what_the_whole_robot_gives(
        drawn in drawn(),
        values in proptest::collection::vec(0.1..1.0_f64, 80),
        target in any::<prop::sample::Index>(),
        source in any::<prop::sample::Index>(),
    ) {
        let topology: &'static Topology = Box::leak(Box::new(topology(&drawn)));
        let kinematics = Kinematics::new(topology).expect("it is a tree");
        let clock = Clock::virtual_at(MonotonicTime::ZERO);
        let joints = Joints::new(topology, JointSettings::default(), clock, Sorted::default(), &[]).expect("it is a tree");
        let positions = &values[..kinematics.positions()];
        for joint in topology.joints {
            let range = kinematics.joint(joint.name).expect("it has one").positions.clone();
            if joint.mimic.is_none() && !range.is_empty() {
                let payload = Placed { joint: joint.name.to_owned(), position: positions[range].to_vec() };
                let stamp = Stamp { frame: Frame::NONE, ..Stamp::default() };
                joints.hear(&stamp.message(payload) as &Stamped<Placed>, MonotonicTime::ZERO);
            }
        }
        let mut frames = Frames::new(kinematics.clone());
        frames.update(positions).expect("as many as it has");
        let link = |index: &prop::sample::Index| topology.links[index.index(topology.links.len())].name;
        let (target, source) = (link(&target), link(&source));
        let find = |name| kinematics.link(name).expect("it has one");
        let expected = frames.transform(find(target), find(source)).expect("they are its own");
        let found = joints.transform(target, source, MonotonicTime::ZERO).expect("all are known");
        let error = (found.to_homogeneous() - expected.to_homogeneous()).abs().max();
        prop_assert!(error < 1e-12, "{target} {source}: {found} {expected}");
        // Messages for viewers give the same result.
        let by_joint = topology.joints.iter().enumerate().map(|(number, _)| {
            let (owner, multiplier, offset) = topology.followed(number);
            let range = kinematics.joint(topology.joints[owner].name).expect("it has one").positions.clone();
            let of_owner = positions[range].to_vec();
            let is_own = owner == number;
            (number, if is_own { of_owner } else { vec![multiplier * of_owner[0] + offset] })
        });
        let by_joint: Vec<(usize, Vec<f64>)> = by_joint.collect();
        let mut root_from_link = Isometry3::identity();
        let mut at = find_number(topology, source);
        while let Some(joint) = topology.links[at].parent_joint.map(|number| &topology.joints[number]) {
            let motion = joint.motion(&by_joint[at - 1].1);
            root_from_link = joint.parent_from_joint.isometry() * motion * root_from_link;
            at = joint.parent;
        }
        let expected = frames.root_from_link(find(source)).expect("it is its own");
        let error = (root_from_link.to_homogeneous() - expected.to_homogeneous()).abs().max();
        prop_assert!(error < 1e-12, "{source}: {root_from_link} {expected}");
    }
}

fn find_number(topology: &Topology, link: &str) -> usize {
    topology.links.iter().position(|other| other.name == link).expect("it has one")
}
