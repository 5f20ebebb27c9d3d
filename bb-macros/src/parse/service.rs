//! `controller stability: Stability() { rate: 100 Hz; }`, and a `bridge` alike: what runs beside the topology.

use super::block::{Head, braced, items, unexpected};
use super::component::Declared;
use super::{Component, Setting};
use crate::diagnostics::Diagnostics;
use proc_macro2::Ident;
use syn::Attribute;
use syn::parse::ParseStream;

#[derive(Clone, Debug)]
pub(crate) struct Service {
    pub(crate) kind: ServiceKind,
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
    pub(crate) component: Component,
    pub(crate) rates: Vec<Setting>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum ServiceKind {
    Controller,
    Bridge,
}

impl ServiceKind {
    /// The word that declares one, which is the first of its path too.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Controller => "controller",
            Self::Bridge => "bridge",
        }
    }

    fn example(self) -> &'static str {
        match self {
            Self::Controller => "controllers { controller stability: Stability(); }",
            Self::Bridge => "bridges { bridge ros: RosBridge(); }",
        }
    }

    /// The word of the block in which it stands.
    fn block(self) -> &'static str {
        match self {
            Self::Controller => "controllers",
            Self::Bridge => "bridges",
        }
    }
}

impl Service {
    /// Reads the braces of `controllers` or `bridges`.
    pub(super) fn parse_all(
        kind: ServiceKind,
        input: ParseStream<'_>,
        diagnostics: &mut Diagnostics,
    ) -> syn::Result<Vec<Self>> {
        let body = braced(input, kind.example())?;
        let mut services = Vec::new();
        items(&body, diagnostics, |head, input, diagnostics| {
            if head.word != kind.word() {
                return Err(unexpected(&head.word, &format!("`{}`", kind.block()), &[kind.word()]));
            }
            services.push(Self::parse(kind, head, input, diagnostics)?);
            Ok(())
        });
        Ok(services)
    }

    fn parse(
        kind: ServiceKind,
        head: Head,
        input: ParseStream<'_>,
        diagnostics: &mut Diagnostics,
    ) -> syn::Result<Self> {
        let Declared { attributes, name, component, body } = Declared::parse(head, input, diagnostics)?;
        let mut rates = Vec::new();
        if let Some(body) = body {
            items(&body, diagnostics, |head, input, diagnostics| {
                if head.word != "rate" {
                    return Err(unexpected(&head.word, &format!("a {}", kind.word()), &["rate"]));
                }
                rates.push(Setting::parse(head, input, diagnostics)?);
                Ok(())
            });
        }
        Ok(Self { kind, attributes, name, component, rates })
    }
}
