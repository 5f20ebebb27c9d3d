//! Parses a URDF's text to the tree of its links.

use super::elements::Reader;
use crate::parse::{Joint, Link, Topology};
use roxmltree::{Document, Node};
use std::collections::{HashMap, HashSet};

/// The root link with everything attached to it; or the faults, each with its line and column.
pub(super) fn root(text: &str, topology: &Topology) -> Result<Link, Vec<String>> {
    let document = Document::parse(text).map_err(|error| {
        let place = error.pos();
        vec![format!("{}:{}: {error}", place.row, place.col)]
    })?;
    let mut reader = Reader::new(&document, topology.place);
    let robot = document.root_element();
    if robot.tag_name().name() != "robot" {
        reader.fault(robot, "expected a <robot> element");
    }
    let mut links = HashMap::new();
    let mut order = Vec::new();
    for node in reader.children(robot, "link") {
        let link = reader.link(node, robot);
        let label = link.label.clone().unwrap_or_default();
        if links.insert(label.clone(), link).is_some() {
            reader.fault(node, &format!("there is a second link {label:?}"));
        }
        order.push((label, node));
    }
    let mut joints: HashMap<String, Vec<(Joint, String)>> = HashMap::new();
    let (mut children, mut names) = (HashSet::new(), HashSet::new());
    for node in reader.children(robot, "joint") {
        let Some(joint) = reader.joint(node, robot) else { continue };
        if !names.insert(joint.label.clone()) {
            reader.fault(node, &format!("there is a second joint {:?}", joint.label.clone().unwrap_or_default()));
        }
        let (Some(parent), Some(child)) = (ends(&mut reader, node, "parent"), ends(&mut reader, node, "child"))
        else {
            continue;
        };
        for (end, name) in [("parent", &parent), ("child", &child)] {
            if !links.contains_key(name) {
                reader.fault(node, &format!("the {end} link {name:?} is not declared"));
            }
        }
        if !children.insert(child.clone()) {
            reader.fault(node, &format!("the link {child:?} is the child of a second joint"));
        }
        joints.entry(parent).or_default().push((joint, child));
    }
    let mut roots = order.iter().filter(|(label, _)| !children.contains(label));
    let root = roots.next();
    for (label, node) in roots {
        reader.fault(*node, &format!("the link {label:?} is a second root; a joint must carry it"));
    }
    if root.is_none() {
        reader.fault(robot, "there is no root link: every link is the child of a joint");
    }
    reader.done()?;
    let label = root.map(|(label, _)| label.clone()).unwrap_or_default();
    let root = assemble(&label, &mut links, &mut joints);
    // A cycle of links has no root.
    match (root, links.keys().next()) {
        (Some(root), None) => Ok(root),
        (_, lost) => Err(vec![format!("1:1: the links around {lost:?} hang on each other in a circle")]),
    }
}

/// Removes a link from the list, with the joints mounted on it and their links.
fn assemble(
    label: &str,
    links: &mut HashMap<String, Link>,
    joints: &mut HashMap<String, Vec<(Joint, String)>>,
) -> Option<Link> {
    let mut link = links.remove(label)?;
    for (mut joint, child) in joints.remove(label).unwrap_or_default() {
        joint.links = assemble(&child, links, joints).into_iter().collect();
        link.joints.push(joint);
    }
    Some(link)
}

fn ends(reader: &mut Reader<'_, '_>, joint: Node<'_, '_>, end: &str) -> Option<String> {
    match joint.children().find(|node| node.tag_name().name() == end) {
        Some(node) => reader.attribute(node, "link").map(str::to_owned),
        None => {
            reader.fault(joint, &format!("this joint has no <{end}>"));
            None
        }
    }
}
