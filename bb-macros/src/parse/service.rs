//! `controller stability: Stability() { rate: 100 Hz; }`, and likewise a `bridge`: components beside the topology.

use super::Notes;
use super::block::{Head, braced};
use super::component::Declared;
use super::items::items;
use super::{Component, Settings};
use crate::language::{BridgeItem, BridgesItem, ControllerItem, ControllersItem, Nothing, ServiceSetting, Word};
use proc_macro2::Ident;
use syn::Attribute;
use syn::parse::ParseStream;

#[derive(Clone, Debug)]
pub(crate) struct Service {
    pub(crate) kind: ServiceKind,
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
    pub(crate) component: Component,
    pub(crate) settings: Settings<ServiceSetting>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum ServiceKind {
    Controller,
    Bridge,
}

impl ServiceKind {
    /// The word that declares one, which is also the first name of its path.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Controller => "controller",
            Self::Bridge => "bridge",
        }
    }
}

impl Service {
    /// Reads the braces of `controllers` or `bridges`, the `word`.
    pub(super) fn parse_all(
        kind: ServiceKind,
        word: &Word,
        input: ParseStream<'_>,
        notes: &mut Notes<'_>,
    ) -> syn::Result<Vec<Self>> {
        let body = braced(input, word)?;
        let mut services = Vec::new();
        let none = &mut Settings::<Nothing>::default();
        match kind {
            ServiceKind::Controller => items(&body, notes, none, |item, head, input, notes| match item {
                ControllersItem::Controller => {
                    Self::parse(kind, head, input, notes).map(|service| services.push(service))
                }
            }),
            ServiceKind::Bridge => items(&body, notes, none, |item, head, input, notes| match item {
                BridgesItem::Bridge => Self::parse(kind, head, input, notes).map(|service| services.push(service)),
            }),
        }
        Ok(services)
    }

    fn parse(kind: ServiceKind, head: Head, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        let Declared { attributes, name, component, body } = Declared::parse(head, input, notes)?;
        let mut settings = Settings::default();
        if let Some(body) = body {
            match kind {
                ServiceKind::Controller => {
                    items::<ControllerItem, _>(&body, notes, &mut settings, |item, _, _, _| match item {});
                }
                ServiceKind::Bridge => {
                    items::<BridgeItem, _>(&body, notes, &mut settings, |item, _, _, _| match item {});
                }
            }
        }
        Ok(Self { kind, attributes, name, component, settings })
    }
}
