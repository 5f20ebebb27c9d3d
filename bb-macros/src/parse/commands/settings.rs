//! Settings of a command: states it is allowed in, time limit, category, and the commands it cancels.

use crate::language::CommandItem;
use crate::parse::Notes;
use crate::parse::block::{Head, colon, semicolon};
use crate::parse::name::one_name;
use crate::parse::record::names;
use proc_macro2::Ident;
use syn::ext::IdentExt;
use syn::parse::ParseStream;

/// All occurrences; a rule reports a second one.
#[derive(Clone, Debug, Default)]
pub(crate) struct CommandSettings {
    pub(crate) allowed_states: Vec<AllowedStates>,
    pub(crate) categories: Vec<InCategory>,
    pub(crate) cancels: Vec<Cancel>,
}

/// `allowed_states: [idle, executing];`
#[derive(Clone, Debug)]
pub(crate) struct AllowedStates {
    pub(crate) states: Vec<Ident>,
}

/// `category: motion;`
#[derive(Clone, Debug)]
pub(crate) struct InCategory {
    pub(crate) name: Ident,
}

/// `cancel: all;` or `cancel: [motion];`
#[derive(Clone, Debug)]
pub(crate) struct Cancel {
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
        item: CommandItem,
        head: Head,
        input: ParseStream<'_>,
        notes: &mut Notes<'_>,
    ) -> syn::Result<()> {
        let Head { word, .. } = head;
        let end = format!("`{word}`");
        match item {
            CommandItem::AllowedStates => self.allowed_states.push(AllowedStates::parse(&word, input)?),
            CommandItem::Category => self.categories.push(InCategory::parse(&word, input)?),
            CommandItem::Cancel => self.cancels.push(Cancel::parse(&word, input)?),
        }
        semicolon(input, &end, notes);
        Ok(())
    }
}

impl AllowedStates {
    fn parse(word: &Ident, input: ParseStream<'_>) -> syn::Result<Self> {
        const EXPECTED: &str = "expected the names of states, as in `[idle, executing]`";
        colon(input, word, "a list of states")?;
        Ok(Self { states: names(input, EXPECTED)? })
    }
}

impl InCategory {
    fn parse(word: &Ident, input: ParseStream<'_>) -> syn::Result<Self> {
        colon(input, word, "its name")?;
        let name = one_name(input, "expected the name of a category")?;
        Ok(Self { name })
    }
}

impl Cancel {
    fn parse(word: &Ident, input: ParseStream<'_>) -> syn::Result<Self> {
        const EXPECTED: &str = "expected `all`, or categories, as in `[motion]`";
        colon(input, word, "`all` or categories")?;
        let ahead = input.fork();
        let cancelled = if ahead.call(Ident::parse_any).is_ok_and(|word| word == "all") {
            input.call(Ident::parse_any)?;
            Cancelled::All
        } else {
            Cancelled::Categories(names(input, EXPECTED)?)
        };
        Ok(Self { cancelled })
    }
}
