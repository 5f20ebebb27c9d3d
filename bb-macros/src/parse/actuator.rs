//! `actuator servo: Dynamixel(id = 3);`

use super::Component;
use super::block::{Head, items, unexpected};
use super::component::Declared;
use crate::diagnostics::Diagnostics;
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
    pub(super) fn parse(head: Head, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<Self> {
        let Declared { attributes, name, component, body } = Declared::parse(head, input, diagnostics)?;
        if let Some(body) = body {
            items(&body, diagnostics, |head, _, _| Err(unexpected(&head.word, "an actuator", &[])));
        }
        Ok(Self { attributes, name, component })
    }
}
