//! `joint pan: revolute { origin: { … }; axis: z; limit: { … }; sensor … link head { … } }`

mod geometry;
mod mechanics;

pub(crate) use geometry::{Axis, Limit, Origin};
pub(crate) use mechanics::{Dynamics, Mimic, Transmission};

use super::Link;
use crate::language::{JointItem, JointKind, Nothing};
use crate::parse::block::{Head, colon, opened, semicolon};
use crate::parse::items::items;
use crate::parse::name::name;
use crate::parse::{Actuator, Notes, Sensor, Settings};
use proc_macro2::Ident;
use syn::ext::IdentExt;
use syn::parse::ParseStream;
use syn::{Attribute, Token};

/// Properties of a joint's motion. Every occurrence of each property is kept: a rule refuses the second.
#[derive(Clone, Debug, Default)]
pub(crate) struct JointProperties {
    pub(crate) origins: Vec<Origin>,
    pub(crate) axes: Vec<Axis>,
    pub(crate) limits: Vec<Limit>,
    pub(crate) dynamics: Vec<Dynamics>,
    pub(crate) mimics: Vec<Mimic>,
    pub(crate) transmissions: Vec<Transmission>,
}

#[derive(Clone, Debug)]
pub(crate) struct Joint {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
    /// Name in the URDF, which need not be an identifier.
    pub(crate) label: Option<String>,
    pub(crate) kind: JointKind,
    pub(crate) kind_word: Ident,
    pub(crate) properties: JointProperties,
    pub(crate) sensors: Vec<Sensor>,
    pub(crate) actuators: Vec<Actuator>,
    pub(crate) links: Vec<Link>,
}

impl Joint {
    pub(super) fn parse(head: Head, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        let name = name(input, &head.word)?;
        colon(input, &name, "the type of the joint")?;
        let place = input.span();
        let kind_word = input
            .call(Ident::parse_any)
            .map_err(|_| syn::Error::new(place, "expected the type of the joint, as in `fixed` or `revolute`"))?;
        let kind = JointKind::named(&kind_word);
        let mut joint = Self {
            attributes: head.attributes,
            name,
            label: None,
            kind: kind.clone().unwrap_or(JointKind::Fixed),
            kind_word,
            properties: JointProperties::default(),
            sensors: Vec::new(),
            actuators: Vec::new(),
            links: Vec::new(),
        };
        if input.peek(syn::token::Brace) {
            let body = opened(input)?;
            let around = std::mem::replace(&mut notes.joint, kind.clone().ok());
            items(&body, notes, &mut Settings::<Nothing>::default(), |item, head, input, notes| {
                joint.item(item, head, input, notes)
            });
            notes.joint = around;
        } else if input.peek(Token![,]) {
            let message = format!(
                "what a joint holds is written in braces: `joint {}: {} {{ … }}`",
                joint.name, joint.kind_word
            );
            return Err(input.error(message));
        } else {
            semicolon(input, &format!("`{}`", joint.name), notes);
        }
        if let Err(error) = kind {
            // Its child is still known; whether it needs an axis and a limit is not.
            notes.syntax(&error);
            joint.properties.axes.clear();
            joint.properties.limits.clear();
        }
        Ok(joint)
    }

    fn item(
        &mut self,
        item: JointItem,
        head: Head,
        input: ParseStream<'_>,
        notes: &mut Notes<'_>,
    ) -> syn::Result<()> {
        match item {
            JointItem::Origin => self.properties.origins.push(Origin::parse(head, input, notes)?),
            JointItem::Axis => self.properties.axes.push(Axis::parse(head, input, notes)?),
            JointItem::Limit => self.properties.limits.push(Limit::parse(head, input, notes)?),
            JointItem::Dynamics => self.properties.dynamics.push(Dynamics::parse(head, input, notes)?),
            JointItem::Mimic => self.properties.mimics.push(Mimic::parse(head, input, notes)?),
            JointItem::Transmission => self.properties.transmissions.push(Transmission::parse(head, input, notes)?),
            JointItem::Sensor => self.sensors.push(Sensor::parse(head, input, notes)?),
            JointItem::Actuator => self.actuators.push(Actuator::parse(head, input, notes)?),
            JointItem::Link => self.links.push(Link::parse(&head, input, notes)?),
        }
        Ok(())
    }
}
