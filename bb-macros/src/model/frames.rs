//! Routes between frames: the joints between, and the transform if all of them are fixed.

use super::{JointId, LinkId, Mount, PublisherId, Rigid, Robot};
use crate::names::text;
use crate::parse::JointKind;
use proc_macro2::Ident;
use syn::Attribute;

/// The route from one frame to another through the tree.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Route {
    /// `target_from_source`; with moving joints at position zero.
    pub(crate) transform: Rigid,
    /// The moving joints on the way.
    pub(crate) moving: Vec<JointId>,
}

impl Robot {
    /// The publishers at a joint that may report its position; `None` if none is needed.
    pub(crate) fn position_sources(&self, id: JointId) -> Option<Vec<PublisherId>> {
        let joint = &self.joints[id];
        if joint.kind == JointKind::Fixed || !joint.properties.mimics.is_empty() {
            return None;
        }
        Some(self.publishers.ids().filter(|publisher| self.mount_of(*publisher) == Mount::Joint(id)).collect())
    }

    /// The route from the frame of `source` to that of `target`; empty without a frame.
    pub(crate) fn route(&self, source: Mount, target: Mount) -> Route {
        let (Some((source, link_from_source)), Some((target, link_from_target))) =
            (self.link_of(source), self.link_of(target))
        else {
            return Route { transform: Rigid::IDENTITY, moving: Vec::new() };
        };
        let (mut up, mut down) = (self.ancestry(source), self.ancestry(target));
        // The common part from the root is not on the route.
        while up.last().is_some() && up.last() == down.last() {
            up.pop();
            down.pop();
        }
        let common_from_source = self.product(&up).then(link_from_source);
        let common_from_target = self.product(&down).then(link_from_target);
        let moving = up.iter().chain(&down).copied().filter(|joint| self.moves(*joint)).collect();
        Route { transform: common_from_target.inverse().then(common_from_source), moving }
    }

    /// The route from a frame to the root's.
    pub(crate) fn route_to_root(&self, source: Mount) -> Option<Route> {
        let root = self.links.ids().next()?;
        (source != Mount::Robot).then(|| self.route(source, Mount::Link(root)))
    }

    /// `parent_from_joint` of the joint's origin.
    pub(crate) fn parent_from_joint(&self, joint: JointId) -> Rigid {
        let origin = self.joints[joint].properties.origins.first();
        let values = |triple: Option<&[crate::parse::Quantity; 3]>| {
            triple.map_or([0.0; 3], |triple| triple.each_ref().map(|quantity| quantity.value))
        };
        origin.map_or(Rigid::IDENTITY, |origin| {
            Rigid::from_xyz_rpy(values(origin.xyz.as_ref()), values(origin.rpy.as_ref()))
        })
    }

    fn moves(&self, joint: JointId) -> bool {
        self.joints[joint].kind != JointKind::Fixed
    }

    /// Every link and joint: the names from the root down to it, its own, and its docs.
    pub(crate) fn places(&self) -> impl Iterator<Item = (Vec<String>, &Ident, &[Attribute])> {
        let links =
            self.links.enumerate().map(|(id, link)| (self.place_of_link(id), &link.name, &*link.attributes));
        let joints = self.joints.iter().map(|joint| {
            let mut place = self.place_of_link(joint.parent);
            place.push(text(&joint.name));
            (place, &joint.name, &*joint.attributes)
        });
        links.chain(joints)
    }

    /// `base`, `mount`, `mast`: the names of links and joints from the root on.
    fn place_of_link(&self, link: LinkId) -> Vec<String> {
        let mut place: Vec<String> = Vec::new();
        let mut current = Some(link);
        while let Some(id) = current {
            let link = &self.links[id];
            place.push(text(&link.name));
            let joint = link.joint.map(|joint| &self.joints[joint]);
            place.extend(joint.map(|joint| text(&joint.name)));
            current = joint.map(|joint| joint.parent);
        }
        place.reverse();
        place
    }

    /// The link that a mount is fixed to, and `link_from_mount`.
    fn link_of(&self, mount: Mount) -> Option<(LinkId, Rigid)> {
        match mount {
            Mount::Robot => None,
            Mount::Link(link) => Some((link, Rigid::IDENTITY)),
            Mount::Joint(joint) => Some((self.joints[joint].parent, self.parent_from_joint(joint))),
        }
    }

    /// The joints from a link up to the root.
    fn ancestry(&self, link: LinkId) -> Vec<JointId> {
        let mut joints = Vec::new();
        let mut link = link;
        while let Some(joint) = self.links[link].joint {
            joints.push(joint);
            link = self.joints[joint].parent;
        }
        joints
    }

    /// `top_from_bottom` over joints from the bottom up.
    fn product(&self, joints: &[JointId]) -> Rigid {
        joints.iter().fold(Rigid::IDENTITY, |product, joint| self.parent_from_joint(*joint).then(product))
    }
}
