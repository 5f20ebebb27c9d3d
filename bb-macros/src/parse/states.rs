//! `states { degraded; moving; }`

use super::block::{braced, items_of, semicolon};
use crate::diagnostics::Diagnostics;
use proc_macro2::Ident;
use syn::Attribute;
use syn::parse::ParseStream;

/// An operational state of the robot, beside those that every robot has.
#[derive(Clone, Debug)]
#[allow(dead_code, reason = "the expansion does not read its docs so far")]
pub(crate) struct State {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
}

impl State {
    /// Reads the braces.
    pub(super) fn parse_all(input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<Vec<Self>> {
        let body = braced(input, "states { degraded; }")?;
        let mut states = Vec::new();
        items_of(
            &body,
            "expected the name of a state, as in `degraded;`",
            diagnostics,
            |head, input, diagnostics| {
                let name = head.name(input)?;
                semicolon(input, &format!("the state `{name}`"), diagnostics);
                states.push(Self { attributes: head.attributes, name });
                Ok(())
            },
        );
        Ok(states)
    }
}
