//! `states { degraded; moving; }`

use super::Notes;
use super::block::{braced, items_of, semicolon};
use proc_macro2::Ident;
use syn::parse::ParseStream;
use syn::{Attribute, Token};

/// An operational state of the robot, in addition to those that every robot has.
#[derive(Clone, Debug)]
#[allow(dead_code, reason = "the expansion does not read its docs so far")]
pub(crate) struct State {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
}

impl State {
    /// Reads the braces.
    pub(super) fn parse_all(input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Vec<Self>> {
        let body = braced(input, &crate::language::words::STATES)?;
        let mut states = Vec::new();
        items_of(&body, "expected the name of a state, as in `degraded;`", notes, |head, input, notes| {
            let name = head.name(input)?;
            if input.peek(Token![:]) || input.peek(Token![=]) {
                return Err(input.error("a state is a name alone, as in `degraded;`; a command leads to it"));
            }
            semicolon(input, &format!("the state `{name}`"), notes);
            states.push(Self { attributes: head.attributes, name });
            Ok(())
        });
        Ok(states)
    }
}
