//! The words for types of joints.

use crate::names::{did_you_mean, one_of};
use proc_macro2::Ident;

/// URDF's types of joints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum JointKind {
    Fixed,
    Revolute,
    Continuous,
    Prismatic,
    Planar,
    Floating,
}

impl JointKind {
    const ALL: [(&'static str, Self); 6] = [
        ("fixed", Self::Fixed),
        ("revolute", Self::Revolute),
        ("continuous", Self::Continuous),
        ("prismatic", Self::Prismatic),
        ("planar", Self::Planar),
        ("floating", Self::Floating),
    ];

    /// The kind of that name.
    pub(crate) fn of(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|(known, _)| *known == name).map(|(_, kind)| kind)
    }

    /// Returns whether the joint turns about an axis, so that its position is an angle.
    pub(crate) fn turns(self) -> bool {
        matches!(self, Self::Revolute | Self::Continuous)
    }

    /// The kind that a word names.
    pub(crate) fn named(word: &Ident) -> syn::Result<Self> {
        let name = word.to_string();
        Self::of(&name).ok_or_else(|| {
            let known = Self::ALL.map(|(known, _)| known);
            let hint = did_you_mean(&name, known);
            syn::Error::new(word.span(), format!("unknown type of joint; expected {}{hint}", one_of(&known)))
        })
    }
}
