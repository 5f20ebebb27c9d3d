//! Adds declarations to the links and joints of a URDF.

use super::{read, refuse_joints};
use crate::diagnostics::Diagnostics;
use crate::names::did_you_mean;
use crate::parse::{Joint, JointAddition, Link, Robot, Topology};
use proc_macro2::{Ident, TokenStream};
use std::path::PathBuf;

pub(super) fn graft(mut tree: Robot, diagnostics: &mut Diagnostics) -> (Robot, TokenStream) {
    let topologies = std::mem::take(&mut tree.topologies);
    for extra in topologies.iter().skip(1) {
        diagnostics.error(&extra.word, "a robot has one topology; leave out all but one".into());
    }
    let Some(topology) = topologies.first() else {
        refuse_joints(&tree, diagnostics);
        return (tree, TokenStream::new());
    };
    let path = path_of(topology);
    let text = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) => {
            let message =
                format!("cannot read {}: {error}; the path is relative to Cargo.toml", topology.file.value());
            diagnostics.at(topology.place, message);
            tree.complete = false;
            return (tree, TokenStream::new());
        }
    };
    let path = path.display().to_string();
    let tracked = quote::quote!(
        const _: &[u8] = ::core::include_bytes!(#path);
    );
    match read::root(&text, topology) {
        Ok(root) => {
            let additions = std::mem::replace(&mut tree.links, vec![root]);
            for link in additions {
                add_to_link(&mut tree, link, diagnostics);
            }
            for joint in std::mem::take(&mut tree.joints) {
                add_to_joint(&mut tree, joint, diagnostics);
            }
        }
        Err(faults) => {
            for fault in faults {
                diagnostics.at(topology.place, format!("{}:{fault}", topology.file.value()));
            }
            tree.complete = false;
        }
    }
    (tree, tracked)
}

/// Relative to the crate that names it.
fn path_of(topology: &Topology) -> PathBuf {
    let folder = std::env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from).unwrap_or_default();
    folder.join(topology.file.value())
}

fn add_to_link(tree: &mut Robot, addition: Link, diagnostics: &mut Diagnostics) {
    let Some(link) = tree.links.iter_mut().find_map(|root| find_link(root, &addition.name)) else {
        let mut names = Vec::new();
        tree.links.iter().for_each(|root| link_names(root, &mut names));
        unknown("link", &addition.name, &names, diagnostics);
        tree.complete = false;
        return;
    };
    // Identifiers keep the span of the declaration, so that editors find it.
    link.name = addition.name;
    link.attributes.extend(addition.attributes);
    link.sensors.extend(addition.sensors);
    link.estimators.extend(addition.estimators);
    link.joints.extend(addition.joints);
    link.body.inertials.extend(addition.body.inertials);
    link.body.visuals.extend(addition.body.visuals);
    link.body.collisions.extend(addition.body.collisions);
}

fn add_to_joint(tree: &mut Robot, addition: JointAddition, diagnostics: &mut Diagnostics) {
    let Some(joint) = tree.links.iter_mut().find_map(|root| find_joint(root, &addition.name)) else {
        let mut names = Vec::new();
        tree.links.iter().for_each(|root| joint_names(root, &mut names));
        unknown("joint", &addition.name, &names, diagnostics);
        tree.complete = false;
        return;
    };
    joint.sensors.extend(addition.sensors);
    joint.actuators.extend(addition.actuators);
}

fn unknown(what: &str, name: &Ident, names: &[String], diagnostics: &mut Diagnostics) {
    let hint = did_you_mean(&name.to_string(), names.iter().map(String::as_str));
    diagnostics.error(name, format!("the URDF has no {what} `{name}`{hint}"));
}

fn find_link<'a>(link: &'a mut Link, name: &Ident) -> Option<&'a mut Link> {
    if link.name == *name {
        return Some(link);
    }
    link.joints.iter_mut().flat_map(|joint| &mut joint.links).find_map(|link| find_link(link, name))
}

fn find_joint<'a>(link: &'a mut Link, name: &Ident) -> Option<&'a mut Joint> {
    for joint in &mut link.joints {
        if joint.name == *name {
            return Some(joint);
        }
        if let Some(found) = joint.links.iter_mut().find_map(|link| find_joint(link, name)) {
            return Some(found);
        }
    }
    None
}

fn link_names(link: &Link, names: &mut Vec<String>) {
    names.push(link.name.to_string());
    link.joints.iter().flat_map(|joint| &joint.links).for_each(|link| link_names(link, names));
}

fn joint_names(link: &Link, names: &mut Vec<String>) {
    for joint in &link.joints {
        names.push(joint.name.to_string());
        joint.links.iter().for_each(|link| joint_names(link, names));
    }
}
