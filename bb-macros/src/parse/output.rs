//! `output pose;` or `output velocity: [nav, velocity];`

use super::block::{Head, semicolon};
use super::component::name;
use crate::diagnostics::Diagnostics;
use proc_macro2::Ident;
use syn::Token;
use syn::parse::{Parse, ParseStream};

#[derive(Clone, Debug)]
pub(crate) struct Output {
    pub(crate) name: Ident,
    /// The path that replaces the one below the estimator's.
    pub(crate) path: Option<Vec<Ident>>,
}

impl Output {
    pub(super) fn parse(head: Head, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<Self> {
        let name = name(input, &head.word)?;
        let mut path = None;
        if input.peek(Token![:]) {
            input.parse::<Token![:]>()?;
            let content;
            let bracket = syn::bracketed!(content in input);
            let segments: Vec<Ident> = content.parse_terminated(Ident::parse, Token![,])?.into_iter().collect();
            if segments.is_empty() {
                let message = "a path has at least one name, as in `[nav, velocity]`";
                return Err(syn::Error::new(bracket.span.join(), message));
            }
            path = Some(segments);
        }
        semicolon(input, &format!("`{name}`"), diagnostics);
        Ok(Self { name, path })
    }
}
