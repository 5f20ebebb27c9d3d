//! `topology: urdf("robot.urdf");`, and declarations at the joints of the URDF: `joint elbow { sensor … }`.

use super::Notes;
use super::block::{Head, braced, semicolon};
use super::items::items;
use super::name::name;
use super::{Actuator, Sensor, Settings};
use crate::diagnostics::Place;
use crate::language::{Nothing, UrdfJointItem, words};
use proc_macro2::Ident;
use syn::ext::IdentExt;
use syn::parse::ParseStream;
use syn::{LitStr, Token};

/// The source of links and joints.
#[derive(Clone, Debug)]
#[cfg_attr(not(feature = "urdf"), allow(dead_code, reason = "without the feature only the place is needed"))]
pub(crate) struct Topology {
    pub(crate) word: Ident,
    /// The file, relative to the crate's `Cargo.toml`.
    pub(crate) file: LitStr,
    /// `urdf("…")`
    pub(crate) place: Place,
}

/// Declarations at a joint of the URDF.
#[derive(Clone, Debug)]
pub(crate) struct JointAddition {
    pub(crate) name: Ident,
    pub(crate) sensors: Vec<Sensor>,
    pub(crate) actuators: Vec<Actuator>,
}

impl Topology {
    pub(super) fn parse(head: Head, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        input.parse::<Token![:]>()?;
        let format = input.call(Ident::parse_any)?;
        if format != "urdf" {
            return Err(syn::Error::new(format.span(), "expected `urdf(\"file.urdf\")`"));
        }
        let content;
        let parenthesis = syn::parenthesized!(content in input);
        let file: LitStr = content.parse()?;
        let place = Place { start: format.span(), end: parenthesis.span.close() };
        semicolon(input, "`topology`", notes);
        Ok(Self { word: head.word, file, place })
    }
}

impl JointAddition {
    pub(super) fn parse(head: &Head, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        let mut joint = Self { name: name(input, &head.word)?, sensors: Vec::new(), actuators: Vec::new() };
        if input.peek(Token![:]) {
            let message =
                "a joint is declared in the link that it is mounted on; only joints of a URDF are named here";
            return Err(input.error(message));
        }
        let body = braced(input, &words::JOINT_OF_URDF)?;
        items(&body, notes, &mut Settings::<Nothing>::default(), |item, head, input, notes| {
            match item {
                UrdfJointItem::Sensor => joint.sensors.push(Sensor::parse(head, input, notes)?),
                UrdfJointItem::Actuator => joint.actuators.push(Actuator::parse(head, input, notes)?),
            }
            Ok(())
        });
        Ok(joint)
    }
}
