//! The contents of braces, item by item, and how to go on behind one that cannot be read.

use super::name::{is_keyword, whole};
use crate::diagnostics::{Diagnostics, Place};
use crate::names::{did_you_mean, one_of};
use proc_macro2::{Delimiter, Ident, TokenTree};
use syn::buffer::Cursor;
use syn::ext::IdentExt;
use syn::parse::{ParseBuffer, ParseStream};
use syn::{Attribute, Token};

/// All words of the language that start an item: where reading can restart.
pub(crate) const WORDS: &[&str] = &[
    "parameters",
    "states",
    "commands",
    "category",
    "sensors",
    "controllers",
    "controller",
    "bridges",
    "bridge",
    "topology",
    "link",
    "joint",
    "sensor",
    "actuator",
    "estimator",
    "input",
    "output",
    "rate",
    "sync_tolerance",
    "latency_budget",
    "lost_after",
    "recover_after",
    "on_degraded",
    "on_lost",
    "on_recovered",
    "runs_on",
    "allowed_states",
    "timeout",
    "cancel",
    "concurrency",
    "origin",
    "axis",
    "limit",
    "dynamics",
    "mimic",
    "transmission",
    "inertial",
    "visual",
    "collision",
];

/// An item's attributes and its first word.
pub(super) struct Head {
    pub(super) attributes: Vec<Attribute>,
    pub(super) word: Ident,
}

impl Head {
    /// The first word as the name that it is where items start with no word of the language.
    pub(super) fn name(&self, input: ParseStream<'_>) -> syn::Result<Ident> {
        let text = self.word.to_string();
        if NO_WORDS.contains(&&*text) && input.peek(Ident::peek_any) {
            let message = format!("what stands in this block starts with its name; leave `{text}` out");
            return Err(syn::Error::new(self.word.span(), message));
        }
        whole(input, &self.word)?;
        if is_keyword(&self.word) {
            let message = format!("`{text}` is a keyword of Rust; choose another name");
            return Err(syn::Error::new(self.word.span(), message));
        }
        Ok(self.word.clone())
    }
}

/// What those may write in front of a name who know that other blocks have a word there.
const NO_WORDS: [&str; 5] = ["command", "state", "parameter", "param", "group"];

/// Reads items until the end. `item` gets each head and reads the rest; an item that it cannot read is reported and
/// skipped.
pub(super) fn items(
    input: ParseStream<'_>,
    diagnostics: &mut Diagnostics,
    item: impl FnMut(Head, ParseStream<'_>, &mut Diagnostics) -> syn::Result<()>,
) {
    let expected = "this starts no part of a robot; expected a word such as `link`, `joint` or `sensor`";
    items_of(input, expected, diagnostics, item);
}

/// The same where items start with a name; `expected` is the error for what is none.
pub(super) fn items_of(
    input: ParseStream<'_>,
    expected: &str,
    diagnostics: &mut Diagnostics,
    mut item: impl FnMut(Head, ParseStream<'_>, &mut Diagnostics) -> syn::Result<()>,
) {
    while !input.is_empty() {
        if input.peek(Token![;]) {
            // One too many is no harm.
            let _: syn::Result<Token![;]> = input.parse();
            continue;
        }
        let result = match head(input, expected, diagnostics) {
            Ok(Some(head)) => item(head, input, diagnostics),
            // Nothing follows a comment that is none.
            Ok(None) => return,
            Err(error) => Err(error),
        };
        if let Err(error) = result {
            diagnostics.syntax(&error);
            skip(input);
        }
    }
}

/// Opens the `{ … }` that must come next, as in `example`.
pub(super) fn braced<'a>(input: ParseStream<'a>, example: &str) -> syn::Result<ParseBuffer<'a>> {
    if !input.peek(syn::token::Brace) {
        return Err(syn::Error::new(input.span(), format!("expected `{{`, as in `{example}`")));
    }
    opened(input)
}

/// Opens a `{ … }` that is known to come next.
pub(super) fn opened<'a>(input: ParseStream<'a>) -> syn::Result<ParseBuffer<'a>> {
    let content;
    syn::braced!(content in input);
    Ok(content)
}

/// Reads `;`. If it is missing that is reported; if the next item follows at once, reading goes on there.
pub(super) fn semicolon(input: ParseStream<'_>, behind: &str, diagnostics: &mut Diagnostics) {
    if input.peek(Token![;]) {
        let _: syn::Result<Token![;]> = input.parse();
        return;
    }
    diagnostics.at(input.span(), format!("expected `;` behind {behind}"));
    skip_to_item(input);
}

/// Reads the `:` behind `name`, in front of `what`.
pub(super) fn colon(input: ParseStream<'_>, name: &Ident, what: &str) -> syn::Result<()> {
    let place = input.span();
    let colon: syn::Result<Token![:]> = input.parse();
    colon.map(drop).map_err(|_| syn::Error::new(place, format!("expected `:` and {what} behind `{name}`")))
}

/// The tokens from `start` up to where `input` stands.
pub(super) fn place_since(start: Cursor<'_>, input: ParseStream<'_>) -> Place {
    let (mut cursor, mut place) = (start, Place::from(input.span()));
    while cursor != input.cursor()
        && let Some((token, next)) = cursor.token_tree()
    {
        let start = if cursor == start { token.span() } else { place.start };
        place = Place { start, end: token.span() };
        cursor = next;
    }
    place
}

/// Skips to the next item, unless one starts here.
pub(super) fn skip_to_item(input: ParseStream<'_>) {
    let ahead = input.fork();
    if ahead.call(Attribute::parse_outer).is_err() || !starts_item(&ahead) {
        skip(input);
    }
}

/// Whether an item starts here: with a word of the language, or a name with a `:` or with braces behind it.
pub(super) fn starts_item(input: ParseStream<'_>) -> bool {
    let is_word = input.fork().call(Ident::parse_any).map(|word| WORDS.contains(&&*word.to_string()));
    let is_name = input.peek2(Token![:]) && !input.peek2(Token![::]) || input.peek2(syn::token::Brace);
    is_word.is_ok_and(|is_word| is_word || is_name)
}

/// The error for a word that does not belong here.
pub(super) fn unexpected(word: &Ident, place: &str, allowed: &[&str]) -> syn::Error {
    let name = word.to_string();
    let message = if allowed.is_empty() {
        format!("{place} holds nothing; leave this out")
    } else if WORDS.contains(&&*name) {
        format!("`{name}` does not belong in {place}, which holds {}", one_of(allowed))
    } else {
        let hint = did_you_mean(&name, allowed.iter().copied());
        format!("unknown word `{name}`; {place} holds {}{hint}", one_of(allowed))
    };
    syn::Error::new(word.span(), message)
}

fn head(input: ParseStream<'_>, expected: &str, diagnostics: &mut Diagnostics) -> syn::Result<Option<Head>> {
    let before = diagnostics.count();
    let attributes = attributes(input, diagnostics)?;
    if input.is_empty() && attributes.is_empty() && diagnostics.count() > before {
        return Ok(None);
    }
    for attribute in attributes.iter().filter(|attribute| !attribute.path().is_ident("doc")) {
        let message = "only doc comments can stand before a part of a robot; leave this attribute out";
        diagnostics.error(attribute, message.into());
    }
    let place = input.span();
    let word = input.call(Ident::parse_any).map_err(|_| syn::Error::new(place, expected))?;
    Ok(Some(Head { attributes, word }))
}

/// Reads attributes and doc comments; what is a comment in other languages is reported and passed over.
pub(super) fn attributes(input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<Vec<Attribute>> {
    let mut attributes = Vec::new();
    while input.peek(Token![#]) {
        if input.peek2(syn::token::Bracket) {
            attributes.extend(input.call(Attribute::parse_outer)?);
            continue;
        }
        let place = input.span();
        let message = if input.peek2(Token![!]) {
            "`//!` and `#![…]` cannot stand in a robot; write `///` before what it documents"
        } else {
            "`#` starts no comment; write `//`"
        };
        diagnostics.at(place, message.into());
        while input.span().start().line == place.start().line && input.parse::<TokenTree>().is_ok() {}
    }
    Ok(attributes)
}

/// Skips to behind the next `;` or `{ … }` of this level.
fn skip(input: ParseStream<'_>) {
    while !input.is_empty() {
        let Ok(token) = input.parse::<TokenTree>() else {
            return;
        };
        match token {
            TokenTree::Punct(punct) if punct.as_char() == ';' => return,
            TokenTree::Group(group) if group.delimiter() == Delimiter::Brace => {
                // A `;` behind braces, as in `origin: { … };`, belongs to the same item; `items` passes it over.
                return;
            }
            _ => {}
        }
    }
}
