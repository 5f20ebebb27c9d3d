//! `link base { sensor … estimator … joint … }`

mod body;
mod joint;

#[cfg(feature = "urdf")]
pub(crate) use body::Material;
pub(crate) use body::{Geometry, Inertial, Shape};
#[cfg(feature = "urdf")]
pub(crate) use joint::Axis;
pub(crate) use joint::{Dynamics, Joint, JointProperties, Limit, Mimic, Origin, Transmission};

use super::block::{Head, opened, semicolon};
use super::items::items;
use super::name::name;
use super::{Estimator, Notes, Sensor, Settings};
use crate::language::{LinkItem, Nothing};
use proc_macro2::{Ident, TokenTree};
use syn::parse::ParseStream;
use syn::{Attribute, Token};

/// The mass and appearance of a link. Every occurrence of each is kept.
#[derive(Clone, Debug, Default)]
pub(crate) struct LinkBody {
    pub(crate) inertials: Vec<Inertial>,
    pub(crate) visuals: Vec<Shape>,
    pub(crate) collisions: Vec<Shape>,
}

#[derive(Clone, Debug)]
pub(crate) struct Link {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
    /// Name in the URDF, which need not be an identifier.
    pub(crate) label: Option<String>,
    pub(crate) sensors: Vec<Sensor>,
    pub(crate) estimators: Vec<Estimator>,
    pub(crate) joints: Vec<Joint>,
    pub(crate) body: LinkBody,
}

impl Link {
    pub(super) fn parse(head: &Head, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        let name = name(input, &head.word)?;
        let mut link = Self {
            attributes: head.attributes.clone(),
            name,
            label: None,
            sensors: Vec::new(),
            estimators: Vec::new(),
            joints: Vec::new(),
            body: LinkBody::default(),
        };
        let is_set = input.peek(Token![:]) || input.peek(Token![=]);
        if is_set && input.peek2(syn::token::Brace) {
            notes.at(input.span(), format!("braces follow the name at once: `link {} {{ … }}`", link.name));
            input.parse::<TokenTree>()?;
        }
        if input.peek(syn::token::Brace) {
            let body = opened(input)?;
            items(&body, notes, &mut Settings::<Nothing>::default(), |item, head, input, notes| {
                link.item(item, head, input, notes)
            });
        } else {
            semicolon(input, &format!("`{}`", link.name), notes);
        }
        Ok(link)
    }

    fn item(
        &mut self,
        item: LinkItem,
        head: Head,
        input: ParseStream<'_>,
        notes: &mut Notes<'_>,
    ) -> syn::Result<()> {
        match item {
            LinkItem::Sensor => self.sensors.push(Sensor::parse(head, input, notes)?),
            LinkItem::Estimator => self.estimators.push(Estimator::parse(head, input, notes)?),
            LinkItem::Joint => self.joints.push(Joint::parse(head, input, notes)?),
            LinkItem::Inertial => self.body.inertials.push(Inertial::parse(head, input, notes)?),
            LinkItem::Visual => self.body.visuals.push(Shape::visual(head, input, notes)?),
            LinkItem::Collision => self.body.collisions.push(Shape::collision(head, input, notes)?),
        }
        Ok(())
    }
}
