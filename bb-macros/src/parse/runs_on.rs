//! `runs_on: worker, priority: 80, core: 1;`

use super::Quantity;
use super::block::{Head, colon, semicolon};
use crate::diagnostics::Diagnostics;
use crate::names::did_you_mean;
use proc_macro2::Ident;
use syn::Token;
use syn::ext::IdentExt;
use syn::parse::ParseStream;

/// A thread of its own.
#[derive(Clone, Debug)]
pub(crate) struct RunsOn {
    pub(crate) word: Ident,
    pub(crate) priority: Option<Quantity>,
    pub(crate) core: Option<Quantity>,
}

impl RunsOn {
    /// Reads what stands behind the word.
    pub(super) fn parse(head: Head, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<Self> {
        const EXPECTED: &str = "expected `worker`; without this setting it runs where its input is published";
        colon(input, &head.word, "`worker`")?;
        let place = input.span();
        let word = input.call(Ident::parse_any).map_err(|_| syn::Error::new(place, EXPECTED))?;
        if word != "worker" {
            return Err(syn::Error::new(word.span(), EXPECTED));
        }
        let mut parsed = Self { word: head.word, priority: None, core: None };
        while input.peek(Token![,]) {
            input.parse::<Token![,]>()?;
            parsed.property(input, diagnostics)?;
        }
        semicolon(input, "`runs_on`", diagnostics);
        Ok(parsed)
    }

    fn property(&mut self, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<()> {
        const EXPECTED: &str = "expected `priority: …` or `core: …`";
        let place = input.span();
        let word = input.call(Ident::parse_any).map_err(|_| syn::Error::new(place, EXPECTED))?;
        let slot = match &*word.to_string() {
            "priority" => &mut self.priority,
            "core" => &mut self.core,
            other => {
                let hint = did_you_mean(other, ["priority", "core"]);
                return Err(syn::Error::new(word.span(), format!("{EXPECTED}{hint}")));
            }
        };
        colon(input, &word, "a number")?;
        if slot.replace(Quantity::parse_count(input)?).is_some() {
            diagnostics.error(&word, format!("`{word}` stands here twice; leave one out"));
        }
        Ok(())
    }
}
