//! Links and joints as constant data, with all fixed joints multiplied out.

use super::literal::{option, transform};
use crate::model::{Joint, Link, LinkId, Mount, Robot};
use crate::parse::{Dynamics, Geometry, Inertial, JointKind, Limit, Mimic, Origin, Quantity, Shape, Transmission};
use crate::verify::Verified;
use proc_macro2::TokenStream;
use quote::quote;
use syn::LitStr;

/// A `bb_core::topology::Topology`.
pub(super) fn topology(verified: &Verified<'_>) -> TokenStream {
    let robot = verified.robot;
    let links = robot.links.enumerate().map(|(id, data)| link(robot, id, data));
    let joints = robot.joints.enumerate().map(|(id, data)| joint(robot, data, verified.children[id]));
    quote!(__private::Topology { links: &[#(#links),*], joints: &[#(#joints),*] })
}

/// The transform to the root, if all joints between are fixed.
pub(super) fn root_from(robot: &Robot, mount: Mount) -> TokenStream {
    let route = robot.route_to_root(mount).filter(|route| route.moving.is_empty());
    option(route.map(|route| transform(route.transform)))
}

fn link(robot: &Robot, id: LinkId, link: &Link) -> TokenStream {
    let name = &link.label;
    let joint = option(link.joint.map(|joint| quote!(#joint)));
    let root = root_from(robot, Mount::Link(id));
    let inertial = option(link.body.inertials.first().map(inertial));
    let visuals = link.body.visuals.iter().map(visual);
    let collisions = link.body.collisions.iter().map(collision);
    quote!(__private::Link {
        name: #name,
        parent_joint: #joint,
        root_from_link: #root,
        inertial: #inertial,
        visuals: &[#(#visuals),*],
        collisions: &[#(#collisions),*],
    })
}

/// Defaults to a reduction of 1 and no offset.
fn transmission(given: &Transmission) -> TokenStream {
    let value = |quantity: &Option<Quantity>, default: f64| quantity.as_ref().map_or(default, |given| given.value);
    let (reduction, offset) = (value(&given.reduction, 1.0), value(&given.offset, 0.0));
    let is_reversed = given.reversed;
    quote!(__private::Transmission { reduction: #reduction, offset: #offset, is_reversed: #is_reversed })
}

fn joint(robot: &Robot, joint: &Joint, child: LinkId) -> TokenStream {
    let name = &joint.label;
    let kind = joint_kind(joint.kind);
    let parent = joint.parent;
    let parent_from_joint = origin(joint.properties.origins.first());
    let axis = option(joint.properties.axes.first().map(|axis| {
        let direction = axis.unit();
        quote!([#(#direction),*])
    }));
    let limit = option(joint.properties.limits.first().map(limit));
    let dynamics = option(joint.properties.dynamics.first().map(dynamics));
    let mimic = option(joint.properties.mimics.first().and_then(|data| mimic(robot, data)));
    let transmission = option(joint.properties.transmissions.first().map(transmission));
    quote!(__private::Joint {
        name: #name,
        kind: __private::JointKind::#kind,
        parent: #parent,
        child: #child,
        parent_from_joint: #parent_from_joint,
        axis: #axis,
        limit: #limit,
        dynamics: #dynamics,
        mimic: #mimic,
        transmission: #transmission,
    })
}

/// Returns an origin with the numbers as declared, so that an exported URDF has the same ones.
fn origin(origin: Option<&Origin>) -> TokenStream {
    let Some(origin) = origin else { return quote!(__private::Origin::IDENTITY) };
    let (xyz, rpy) = (values(origin.xyz.as_ref(), 0.0), values(origin.rpy.as_ref(), 0.0));
    quote!(__private::Origin { xyz: [#(#xyz),*], rpy: [#(#rpy),*] })
}

fn limit(limit: &Limit) -> TokenStream {
    let value = |quantity: &Option<Quantity>| {
        option(quantity.as_ref().map(|quantity| {
            let value = quantity.value;
            quote!(#value)
        }))
    };
    let (lower, upper, velocity, effort) =
        (value(&limit.lower), value(&limit.upper), value(&limit.velocity), value(&limit.effort));
    quote!(__private::Limit { lower: #lower, upper: #upper, velocity: #velocity, effort: #effort })
}

fn dynamics(dynamics: &Dynamics) -> TokenStream {
    let (damping, friction) = (value(dynamics.damping.as_ref(), 0.0), value(dynamics.friction.as_ref(), 0.0));
    quote!(__private::Dynamics { damping: #damping, friction: #friction })
}

fn mimic(robot: &Robot, mimic: &Mimic) -> Option<TokenStream> {
    let joint = robot.joints.position(|joint| Some(&joint.name) == mimic.joint.as_ref())?;
    let (multiplier, offset) = (value(mimic.multiplier.as_ref(), 1.0), value(mimic.offset.as_ref(), 0.0));
    Some(quote!(__private::Mimic { joint: #joint, multiplier: #multiplier, offset: #offset }))
}

fn inertial(inertial: &Inertial) -> TokenStream {
    let (link_from_inertia, mass) = (origin(inertial.origin.as_ref()), value(inertial.mass.as_ref(), 0.0));
    let moments = inertial.inertia.each_ref().map(|moment| value(moment.as_ref(), 0.0));
    quote!(__private::Inertial {
        link_from_inertia: #link_from_inertia,
        mass: #mass,
        inertia: [#(#moments),*],
    })
}

fn visual(shape: &Shape) -> TokenStream {
    let (link_from_shape, geometry) = (origin(shape.origin.as_ref()), geometry(shape));
    let material = option(shape.material.as_ref().map(|material| {
        let name = material.name.as_ref().map_or(String::new(), LitStr::value);
        let texture = option(material.texture.as_ref().map(|texture| quote!(#texture)));
        let color = option(material.color.as_ref().map(|color| {
            let color = color.each_ref().map(|part| part.value);
            quote!([#(#color),*])
        }));
        quote!(__private::Material { name: #name, color: #color, texture: #texture })
    }));
    quote!(__private::Visual {
        link_from_shape: #link_from_shape,
        geometry: #geometry,
        material: #material,
    })
}

fn collision(shape: &Shape) -> TokenStream {
    let (link_from_shape, geometry) = (origin(shape.origin.as_ref()), geometry(shape));
    quote!(__private::Collision { link_from_shape: #link_from_shape, geometry: #geometry })
}

/// A verified shape has exactly one geometry, with all its sizes.
fn geometry(shape: &Shape) -> TokenStream {
    let none = Geometry::Sphere { radius: None };
    match shape.geometries.first().map_or(&none, |(_, geometry)| geometry) {
        Geometry::Box(size) => {
            let size = size.each_ref().map(|length| length.value);
            quote!(__private::Geometry::Box([#(#size),*]))
        }
        Geometry::Cylinder { radius, length } => {
            let (radius, length) = (value(radius.as_ref(), 0.0), value(length.as_ref(), 0.0));
            quote!(__private::Geometry::Cylinder { radius: #radius, length: #length })
        }
        Geometry::Sphere { radius } => {
            let radius = value(radius.as_ref(), 0.0);
            quote!(__private::Geometry::Sphere { radius: #radius })
        }
        Geometry::Mesh { file, scale } => {
            let file = file.as_ref().map_or(String::new(), LitStr::value);
            let scale = values(scale.as_ref(), 1.0);
            quote!(__private::Geometry::Mesh { file: #file, scale: [#(#scale),*] })
        }
    }
}

fn value(quantity: Option<&Quantity>, default: f64) -> f64 {
    quantity.map_or(default, |quantity| quantity.value)
}

fn values(triple: Option<&[Quantity; 3]>, default: f64) -> [f64; 3] {
    triple.map_or([default; 3], |triple| triple.each_ref().map(|quantity| quantity.value))
}

/// The name of a joint's kind in `bb_core`.
fn joint_kind(kind: JointKind) -> TokenStream {
    match kind {
        JointKind::Fixed => quote!(Fixed),
        JointKind::Revolute => quote!(Revolute),
        JointKind::Continuous => quote!(Continuous),
        JointKind::Prismatic => quote!(Prismatic),
        JointKind::Planar => quote!(Planar),
        JointKind::Floating => quote!(Floating),
    }
}
