//! An inertial has a mass and its three main moments; a visual or a collision has exactly one shape with its sizes.
//! None of these values is negative.
//!
//! Right: `inertial: { mass: 2 kg, inertia: { xx: 0.1 kg*m^2, yy: 0.1 kg*m^2, zz: 0.1 kg*m^2 } };`
//! Wrong: `visual: { cylinder: { radius: 0.1 m } };`

use crate::diagnostics::Diagnostics;
use crate::model::Robot;
use crate::parse::{Geometry, Inertial, Quantity, Shape};
use proc_macro2::Ident;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    for link in &robot.links {
        for body in &link.body.inertials {
            inertial(body, diagnostics);
        }
        for body in link.body.visuals.iter().chain(&link.body.collisions) {
            shape(body, diagnostics);
        }
    }
}

fn inertial(inertial: &Inertial, diagnostics: &mut Diagnostics) {
    let [xx, _, _, yy, _, zz] = &inertial.inertia;
    for (name, value) in [("mass", &inertial.mass), ("inertia.xx", xx), ("inertia.yy", yy), ("inertia.zz", zz)] {
        needed(&inertial.word, "an inertial", name, value.as_ref(), diagnostics);
    }
}

fn shape(shape: &Shape, diagnostics: &mut Diagnostics) {
    let Some((word, geometry)) = shape.geometries.first() else {
        let message = "there is no shape; give it one of `box`, `cylinder`, `sphere` and `mesh`";
        return diagnostics.error(&shape.word, message.into());
    };
    for (extra, _) in shape.geometries.iter().skip(1) {
        diagnostics.error(
            extra,
            format!("there is already a `{word}`; put a second shape into a `{}` of its own", shape.word),
        );
    }
    match geometry {
        Geometry::Box(size) => size.iter().for_each(|length| not_negative(length, diagnostics)),
        Geometry::Cylinder { radius, length } => {
            needed(word, "a cylinder", "radius", radius.as_ref(), diagnostics);
            needed(word, "a cylinder", "length", length.as_ref(), diagnostics);
        }
        Geometry::Sphere { radius } => needed(word, "a sphere", "radius", radius.as_ref(), diagnostics),
        Geometry::Mesh { file: None, .. } => {
            diagnostics.error(word, "a mesh needs a file, as in `file: \"package://robot/base.stl\"`".into());
        }
        Geometry::Mesh { .. } => {}
    }
}

fn needed(word: &Ident, what: &str, name: &str, value: Option<&Quantity>, diagnostics: &mut Diagnostics) {
    match value {
        Some(value) => not_negative(value, diagnostics),
        None => diagnostics.error(word, format!("{what} needs `{name}`")),
    }
}

fn not_negative(quantity: &Quantity, diagnostics: &mut Diagnostics) {
    if quantity.value < 0.0 {
        diagnostics.at(quantity.place, "this must not be negative".into());
    }
}
