//! `actuator servo: Dynamixel(id = 3);`

use super::Component;
use super::Notes;
use super::Settings;
use super::block::Head;
use super::component::Declared;
use super::items::items;
use crate::language::{ActuatorItem, Nothing};
use proc_macro2::Ident;
use syn::Attribute;
use syn::parse::ParseStream;

#[derive(Clone, Debug)]
pub(crate) struct Actuator {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
    pub(crate) component: Component,
}

impl Actuator {
    pub(super) fn parse(head: Head, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        let Declared { attributes, name, component, body } = Declared::parse(head, input, notes)?;
        if let Some(body) = body {
            items::<ActuatorItem, Nothing>(&body, notes, &mut Settings::default(), |item, _, _, _| match item {});
        }
        Ok(Self { attributes, name, component })
    }
}
