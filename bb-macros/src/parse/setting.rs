//! A setting: a word, a colon and a quantity.

use super::Quantity;
use super::block::{Head, colon, semicolon};
use crate::diagnostics::Diagnostics;
use proc_macro2::Ident;
use syn::parse::ParseStream;

/// `rate: 200 Hz;`
#[derive(Clone, Debug)]
pub(crate) struct Setting {
    pub(crate) word: Ident,
    pub(crate) quantity: Quantity,
}

impl Setting {
    /// Reads what stands behind the word.
    pub(super) fn parse(head: Head, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<Self> {
        Self::parse_with(Quantity::parse, head, input, diagnostics)
    }

    /// The same for a number that counts.
    pub(super) fn parse_count(
        head: Head,
        input: ParseStream<'_>,
        diagnostics: &mut Diagnostics,
    ) -> syn::Result<Self> {
        Self::parse_with(Quantity::parse_count, head, input, diagnostics)
    }

    fn parse_with(
        quantity: impl FnOnce(ParseStream<'_>) -> syn::Result<Quantity>,
        head: Head,
        input: ParseStream<'_>,
        diagnostics: &mut Diagnostics,
    ) -> syn::Result<Self> {
        colon(input, &head.word, "a value")?;
        let quantity = quantity(input)?;
        semicolon(input, &format!("`{}`", head.word), diagnostics);
        Ok(Self { word: head.word, quantity })
    }
}
