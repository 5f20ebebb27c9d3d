//! `output pose;` or `output velocity: [nav, velocity];`

use super::Notes;
use super::block::{Head, semicolon};
use super::name::name;
use super::record::names;
use proc_macro2::Ident;
use syn::parse::ParseStream;
use syn::{Attribute, Token};

#[derive(Clone, Debug)]
pub(crate) struct Output {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
    /// The path that replaces the one below the estimator's.
    pub(crate) path: Option<Vec<Ident>>,
}

impl Output {
    pub(super) fn parse(head: Head, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        let name = name(input, &head.word)?;
        let mut path = None;
        if input.peek(Token![:]) {
            input.parse::<Token![:]>()?;
            path = Some(names(
                input,
                "expected a path in brackets, as in `[nav, velocity]`; the algorithm gives the type",
            )?);
        }
        semicolon(input, &format!("`{name}`"), notes);
        Ok(Self { attributes: head.attributes, name, path })
    }
}
