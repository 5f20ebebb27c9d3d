//! When a command may run, how long, beside which others, and which it ends.

use crate::diagnostics::Diagnostics;
use crate::parse::Setting;
use crate::parse::block::{Head, colon, semicolon, unexpected};
use crate::parse::record::names;
use proc_macro2::Ident;
use syn::ext::IdentExt;
use syn::parse::ParseStream;

/// All that were written; each may stand once.
#[derive(Clone, Debug, Default)]
pub(crate) struct CommandSettings {
    pub(crate) allowed_states: Vec<AllowedStates>,
    pub(crate) timeouts: Vec<Setting>,
    pub(crate) categories: Vec<InCategory>,
    pub(crate) cancels: Vec<Cancel>,
}

/// `allowed_states: [idle, executing];`
#[derive(Clone, Debug)]
pub(crate) struct AllowedStates {
    pub(crate) word: Ident,
    pub(crate) states: Vec<Ident>,
}

/// `category: motion;`
#[derive(Clone, Debug)]
pub(crate) struct InCategory {
    pub(crate) word: Ident,
    pub(crate) name: Ident,
}

/// `cancel: all;` or `cancel: [motion];`
#[derive(Clone, Debug)]
pub(crate) struct Cancel {
    pub(crate) word: Ident,
    pub(crate) cancelled: Cancelled,
}

#[derive(Clone, Debug)]
pub(crate) enum Cancelled {
    All,
    /// The commands of these categories.
    Categories(Vec<Ident>),
}

impl CommandSettings {
    pub(super) fn item(
        &mut self,
        head: Head,
        input: ParseStream<'_>,
        diagnostics: &mut Diagnostics,
    ) -> syn::Result<()> {
        let Head { word, .. } = &head;
        match &*word.to_string() {
            "allowed_states" => self.allowed_states.push(AllowedStates::parse(word.clone(), input)?),
            "timeout" => {
                self.timeouts.push(Setting::parse(head, input, diagnostics)?);
                return Ok(());
            }
            "category" => self.categories.push(InCategory::parse(word.clone(), input)?),
            "cancel" => self.cancels.push(Cancel::parse(word.clone(), input)?),
            _ => {
                let allowed = ["allowed_states", "timeout", "category", "cancel"];
                return Err(unexpected(word, "a command", &allowed));
            }
        }
        semicolon(input, &format!("`{word}`"), diagnostics);
        Ok(())
    }
}

impl AllowedStates {
    fn parse(word: Ident, input: ParseStream<'_>) -> syn::Result<Self> {
        const EXPECTED: &str = "expected the names of states, as in `[idle, executing]`";
        colon(input, &word, "a list of states")?;
        Ok(Self { word, states: list(input, EXPECTED)? })
    }
}

impl InCategory {
    fn parse(word: Ident, input: ParseStream<'_>) -> syn::Result<Self> {
        colon(input, &word, "its name")?;
        let place = input.span();
        let name = input.parse().map_err(|_| syn::Error::new(place, "expected the name of a category"))?;
        Ok(Self { word, name })
    }
}

impl Cancel {
    fn parse(word: Ident, input: ParseStream<'_>) -> syn::Result<Self> {
        const EXPECTED: &str = "expected `all`, or categories, as in `[motion]`";
        colon(input, &word, "`all` or categories")?;
        let ahead = input.fork();
        let cancelled = if ahead.call(Ident::parse_any).is_ok_and(|word| word == "all") {
            input.call(Ident::parse_any)?;
            Cancelled::All
        } else {
            Cancelled::Categories(list(input, EXPECTED)?)
        };
        Ok(Self { word, cancelled })
    }
}

fn list(input: ParseStream<'_>, expected: &str) -> syn::Result<Vec<Ident>> {
    if input.peek(syn::token::Bracket) { names(input, expected) } else { Err(input.error(expected)) }
}
