//! Revolute, prismatic, continuous and planar joints have an axis; revolute and prismatic ones a limit with `lower`
//! and `upper`; a fixed joint has neither. (A floating joint moves freely, and has no axis either.) For every kind of
//! joint, a lower limit is below the upper one. An origin is not so far away that the transforms between joints could
//! no longer be multiplied out.
//!
//! Right: `joint pan: revolute { axis: z; limit: { lower: -90 deg, upper: 90 deg }; link head { } }`
//! Wrong: `joint pan: revolute { link head { } }`

use crate::diagnostics::Diagnostics;
use crate::model::{Joint, Robot};
use crate::parse::{JointKind, Limit};
use crate::units::Dimension;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    // The reader of a URDF reports these with their lines.
    for joint in robot.joints.iter().filter(|joint| !joint.from_urdf) {
        axis(joint, robot.complete, diagnostics);
        limit(joint, robot.complete, diagnostics);
        origin(joint, diagnostics);
    }
}

/// A light year.
const FARTHEST_M: f64 = 9.46e15;

fn origin(joint: &Joint, diagnostics: &mut Diagnostics) {
    for length in joint.properties.origins.iter().filter_map(|origin| origin.xyz.as_ref()).flatten() {
        if length.dimension == Dimension::LENGTH && length.value.abs() > FARTHEST_M {
            diagnostics.at(length.place, "this is farther than a light year; bring it nearer".into());
        }
    }
}

fn axis(joint: &Joint, complete: bool, diagnostics: &mut Diagnostics) {
    let (kind, name) = (&joint.kind_word, &joint.name);
    let moves_about_none = matches!(joint.kind, JointKind::Fixed | JointKind::Floating);
    match joint.properties.axes.first() {
        Some(axis) if moves_about_none => {
            diagnostics.error(&axis.word, format!("a {kind} joint has no axis; leave it out of `{name}`"));
        }
        Some(axis) => {
            let length = axis.direction.iter().map(|value| value * value).sum::<f64>().sqrt();
            // A unit is reported by another rule.
            let is_plain = axis.components.iter().all(|component| !component.has_unit);
            if is_plain && !(length.is_finite() && length > 1e-9) {
                diagnostics.at(axis.place, "this axis has no direction; give it a component that is not 0".into());
            }
        }
        None if !moves_about_none && complete => {
            let message = format!("a {kind} joint needs an axis; give `{name}` one, as in `axis: z;`");
            diagnostics.error(kind, message);
        }
        None => {}
    }
}

fn limit(joint: &Joint, complete: bool, diagnostics: &mut Diagnostics) {
    let (kind, name) = (&joint.kind_word, &joint.name);
    let needs_one = matches!(joint.kind, JointKind::Revolute | JointKind::Prismatic);
    match joint.properties.limits.first() {
        Some(limit) if joint.kind == JointKind::Fixed => {
            diagnostics.error(&limit.word, format!("a fixed joint has no limit; leave it out of `{name}`"));
        }
        Some(limit) => {
            if needs_one && (limit.lower.is_none() || limit.upper.is_none()) {
                let message = format!("the limit of a {kind} joint needs both `lower` and `upper`");
                diagnostics.error(&limit.word, message);
            }
            range(limit, diagnostics);
        }
        None if needs_one && complete => {
            let unit = if joint.kind == JointKind::Revolute { "deg" } else { "m" };
            let message = format!(
                "a {kind} joint needs a limit; give `{name}` one, as in `limit: {{ lower: -1 {unit}, upper: 1 {unit} }};`"
            );
            diagnostics.error(kind, message);
        }
        None => {}
    }
}

/// Checks the range of every kind of joint: even if no limit is needed, one that excludes every position is a mistake.
fn range(limit: &Limit, diagnostics: &mut Diagnostics) {
    if let (Some(lower), Some(upper)) = (&limit.lower, &limit.upper)
        && lower.dimension == upper.dimension
        && lower.value >= upper.value
    {
        diagnostics.at(upper.place, "the upper limit must be above the lower one".into());
    }
}
