//! A mimicking joint names another declared joint, moves as that one does, and does not follow itself in a cycle.
//!
//! Right: `joint right: prismatic { …; mimic: { joint: left, multiplier: -1 }; … }` where `left` is prismatic
//! Wrong: `mimic: { joint: lift };` where there is none

use crate::diagnostics::Diagnostics;
use crate::model::{Joint, JointId, Robot};
use crate::names::did_you_mean;
use crate::parse::{JointKind, Mimic};
use proc_macro2::Ident;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    for (id, joint) in robot.joints.enumerate() {
        let Some(mimic) = joint.properties.mimics.first() else { continue };
        match &mimic.joint {
            None => diagnostics.error(&mimic.word, "the joint to follow is missing, as in `joint: other`".into()),
            Some(_) if !moves(joint) => {
                let message = format!("a {} joint cannot follow another; leave this out", joint.kind_word);
                diagnostics.error(&mimic.word, message);
            }
            Some(name) => followed(robot, id, joint, name, diagnostics),
        }
    }
}

fn followed(robot: &Robot, id: JointId, joint: &Joint, name: &Ident, diagnostics: &mut Diagnostics) {
    let Some((other_id, other)) = find(robot, name) else {
        if robot.complete {
            let names: Vec<String> = robot.joints.iter().map(|joint| joint.name.to_string()).collect();
            let hint = did_you_mean(&name.to_string(), names.iter().map(String::as_str));
            diagnostics.error(name, format!("there is no joint `{name}`{hint}"));
        }
        return;
    };
    if other_id == id {
        diagnostics.error(name, format!("the joint `{name}` cannot follow itself"));
    } else if slides(joint) != slides(other) || !moves(other) {
        let message = format!(
            "the joint `{}` is {} and cannot follow `{name}`, which is {}",
            joint.name, joint.kind_word, other.kind_word
        );
        diagnostics.error(name, message);
    } else if is_circle(robot, id) {
        diagnostics
            .error(name, format!("the joint `{}` follows itself in a circle; let one of them lead", joint.name));
    }
}

fn find<'a>(robot: &'a Robot, name: &Ident) -> Option<(JointId, &'a Joint)> {
    robot.joints.enumerate().find(|(_, joint)| joint.name == *name)
}

/// Returns whether following leads back to the start; each cycle is reported only at its first joint.
fn is_circle(robot: &Robot, start: JointId) -> bool {
    let mut id = start;
    for _ in robot.joints.ids() {
        let name = robot.joints[id].properties.mimics.first().and_then(|Mimic { joint, .. }| joint.as_ref());
        let Some((next, _)) = name.and_then(|name| find(robot, name)) else { return false };
        if next == start {
            return true;
        }
        if next < start {
            return false;
        }
        id = next;
    }
    false
}

fn moves(joint: &Joint) -> bool {
    matches!(joint.kind, JointKind::Revolute | JointKind::Continuous | JointKind::Prismatic)
}

fn slides(joint: &Joint) -> bool {
    joint.kind == JointKind::Prismatic
}
