//! Commands called by a change of health: `on_lost: stop;`

use super::Notes;
use super::block::{Head, colon, semicolon};
use super::name::{one_name, whole};
use proc_macro2::Ident;
use syn::parse::ParseStream;

/// All occurrences; a rule reports a second one.
#[derive(Clone, Debug, Default)]
pub(crate) struct Reactions {
    pub(crate) on_degraded: Vec<Reaction>,
    pub(crate) on_lost: Vec<Reaction>,
    pub(crate) on_recovered: Vec<Reaction>,
}

/// `on_lost: stop;`
#[derive(Clone, Debug)]
pub(crate) struct Reaction {
    pub(crate) word: Ident,
    /// The name of the command.
    pub(crate) command: Ident,
}

impl Reactions {
    /// All, in the order of their words.
    pub(crate) fn all(&self) -> impl Iterator<Item = &Reaction> {
        self.on_degraded.iter().chain(&self.on_lost).chain(&self.on_recovered)
    }
}

impl Reaction {
    /// Reads what follows the word.
    pub(super) fn parse(head: Head, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        colon(input, &head.word, "the name of a command")?;
        let command = one_name(input, &format!("expected the name of one command, as in `{}: stop;`", head.word))?;
        whole(input, &command)?;
        if input.peek(syn::token::Paren) {
            let message = format!("a command is named without parentheses; write `{}: {command};`", head.word);
            return Err(input.error(message));
        }
        semicolon(input, &format!("`{}`", head.word), notes);
        Ok(Self { word: head.word, command })
    }
}
