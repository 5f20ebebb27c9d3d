//! `runs_on: worker, priority: 80, core: 1;`

use super::Notes;
use super::Quantity;
use super::block::{Head, colon, semicolon};
use super::record::properties;
use crate::language::RunsOnField;
use proc_macro2::Ident;
use syn::ext::IdentExt;
use syn::parse::ParseStream;

/// A separate thread.
#[derive(Clone, Debug)]
pub(crate) struct RunsOn {
    pub(crate) priority: Option<Quantity>,
    pub(crate) core: Option<Quantity>,
}

impl RunsOn {
    /// Reads what follows the word.
    pub(super) fn parse(head: Head, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        const EXPECTED: &str = "expected `worker`; without this setting it runs where its input is published";
        colon(input, &head.word, "`worker`")?;
        let place = input.span();
        let word = input.call(Ident::parse_any).map_err(|_| syn::Error::new(place, EXPECTED))?;
        if word != "worker" {
            return Err(syn::Error::new(word.span(), EXPECTED));
        }
        let mut parsed = Self { priority: None, core: None };
        properties(input, notes, |field, word, ident, input, notes| {
            let slot = match field {
                RunsOnField::Priority => &mut parsed.priority,
                RunsOnField::Core => &mut parsed.core,
            };
            if slot.replace(notes.number(word, input)?).is_some() {
                notes.repeat(ident.clone());
            }
            Ok(())
        })?;
        semicolon(input, "`runs_on`", notes);
        Ok(parsed)
    }
}
