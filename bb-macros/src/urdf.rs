//! Links and joints from a URDF file, read and merged into the tree of the robot that names it.
//!
//! A fault of the file is reported at the `urdf(…)` token with its line and column. The file is tracked, so that a
//! change rebuilds.

#[cfg(feature = "urdf")]
mod elements;
#[cfg(feature = "urdf")]
mod graft;
#[cfg(feature = "urdf")]
mod read;
#[cfg(all(test, feature = "urdf"))]
mod tests;

use crate::diagnostics::Diagnostics;
use crate::parse::Robot;
use proc_macro2::TokenStream;

/// The tree with the links and joints of its URDF, if it names one, and the tokens that make the compiler track the
/// file.
#[cfg(feature = "urdf")]
pub(crate) fn graft(tree: Robot, diagnostics: &mut Diagnostics) -> (Robot, TokenStream) {
    graft::graft(tree, diagnostics)
}

/// Reports an error if a robot names a URDF, without the feature.
#[cfg(not(feature = "urdf"))]
pub(crate) fn graft(mut tree: Robot, diagnostics: &mut Diagnostics) -> (Robot, TokenStream) {
    for topology in &tree.topologies {
        let message = "reading a URDF needs the feature `urdf` of bb-core; add it in Cargo.toml";
        diagnostics.at(topology.place, message.into());
        tree.complete = false;
    }
    if tree.topologies.is_empty() {
        refuse_joints(&tree, diagnostics);
    }
    (tree, TokenStream::new())
}

/// Joints are named at the robot's level only if they come from a URDF.
fn refuse_joints(tree: &Robot, diagnostics: &mut Diagnostics) {
    for joint in &tree.joints {
        let message = "a joint is declared in the link that it is mounted on; only joints of a URDF are named here";
        diagnostics.error(&joint.name, message.into());
    }
}
