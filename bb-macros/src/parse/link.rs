//! `link base { sensor … estimator … joint … }`

use super::block::{Head, items, opened, semicolon, unexpected};
use super::name::name;
use super::{Estimator, Inertial, Joint, Sensor, Shape};
use crate::diagnostics::Diagnostics;
use proc_macro2::Ident;
use syn::Attribute;
use syn::parse::ParseStream;

#[derive(Clone, Debug)]
pub(crate) struct Link {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
    /// Its name as a URDF has it, which need not be an identifier.
    pub(crate) label: Option<String>,
    pub(crate) sensors: Vec<Sensor>,
    pub(crate) estimators: Vec<Estimator>,
    pub(crate) joints: Vec<Joint>,
    pub(crate) inertials: Vec<Inertial>,
    pub(crate) visuals: Vec<Shape>,
    pub(crate) collisions: Vec<Shape>,
}

/// What a link holds.
const WORDS: &[&str] = &["sensor", "estimator", "joint", "inertial", "visual", "collision"];

impl Link {
    pub(super) fn parse(head: &Head, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<Self> {
        let name = name(input, &head.word)?;
        let mut link = Self {
            attributes: head.attributes.clone(),
            name,
            label: None,
            sensors: Vec::new(),
            estimators: Vec::new(),
            joints: Vec::new(),
            inertials: Vec::new(),
            visuals: Vec::new(),
            collisions: Vec::new(),
        };
        if input.peek(syn::token::Brace) {
            let body = opened(input)?;
            items(&body, diagnostics, |head, input, diagnostics| link.item(head, input, diagnostics));
        } else {
            semicolon(input, &format!("`{}`", link.name), diagnostics);
        }
        Ok(link)
    }

    fn item(&mut self, head: Head, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<()> {
        match &*head.word.to_string() {
            "sensor" => self.sensors.push(Sensor::parse(head, input, diagnostics)?),
            "estimator" => self.estimators.push(Estimator::parse(head, input, diagnostics)?),
            "joint" => self.joints.push(Joint::parse(head, input, diagnostics)?),
            "inertial" => self.inertials.push(Inertial::parse(head, input, diagnostics)?),
            "visual" => self.visuals.push(Shape::parse(head, input, diagnostics)?),
            "collision" => self.collisions.push(Shape::parse(head, input, diagnostics)?),
            _ => return Err(unexpected(&head.word, "a link", WORDS)),
        }
        Ok(())
    }
}
