//! The contents of braces, item by item, and recovery after an item that cannot be read.

use super::Notes;
use super::name::{is_keyword, whole};
use super::tokens::starts_item;
use crate::language::Word;
use proc_macro2::{Delimiter, Ident, TokenTree};
use syn::ext::IdentExt;
use syn::parse::{ParseBuffer, ParseStream};
use syn::{Attribute, Token};

/// An item's attributes and its first word.
pub(super) struct Head {
    pub(super) attributes: Vec<Attribute>,
    pub(super) word: Ident,
}

impl Head {
    /// The first word as a name, in places where items start with a name instead of a word of the language.
    pub(super) fn name(&self, input: ParseStream<'_>) -> syn::Result<Ident> {
        let text = self.word.to_string();
        if NO_WORDS.contains(&&*text) && input.peek(Ident::peek_any) {
            let message = format!("an item of this block starts with its name; leave `{text}` out");
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

/// Words that people write before a name, because other blocks require one.
const NO_WORDS: [&str; 5] = ["command", "state", "parameter", "param", "group"];

/// Reads items until the end, each by its head; `expected` is the error for tokens that start no item. An item that
/// cannot be read is reported and skipped.
pub(super) fn items_of(
    input: ParseStream<'_>,
    expected: &str,
    notes: &mut Notes<'_>,
    mut item: impl FnMut(Head, ParseStream<'_>, &mut Notes<'_>) -> syn::Result<()>,
) {
    while !input.is_empty() {
        if input.peek(Token![;]) {
            // An extra one is harmless.
            let _: syn::Result<Token![;]> = input.parse();
            continue;
        }
        let result = match head(input, expected, notes) {
            Ok(Some(head)) => item(head, input, notes),
            // Nothing can be read after a comment in another language's syntax.
            Ok(None) => return,
            Err(error) => Err(error),
        };
        if let Err(error) = result {
            notes.syntax(&error);
            skip(input);
        }
    }
}

/// Opens the `{ … }` that must follow `word`.
pub(super) fn braced<'a>(input: ParseStream<'a>, word: &Word) -> syn::Result<ParseBuffer<'a>> {
    if !input.peek(syn::token::Brace) {
        let message = format!("expected `{{`, as in `{}{}`", word.text, word.example);
        return Err(syn::Error::new(input.span(), message));
    }
    opened(input)
}

/// Opens a `{ … }` that is known to follow.
pub(super) fn opened<'a>(input: ParseStream<'a>) -> syn::Result<ParseBuffer<'a>> {
    let content;
    syn::braced!(content in input);
    Ok(content)
}

/// Reads `;`. If it is missing, that is reported, and reading resumes at the next item.
pub(super) fn semicolon(input: ParseStream<'_>, after: &str, notes: &mut Notes<'_>) {
    if input.peek(Token![;]) {
        let _: syn::Result<Token![;]> = input.parse();
        return;
    }
    notes.at(input.span(), format!("expected `;` after {after}"));
    skip_to_item(input);
}

/// Reads the `:` after `name`, before `what`.
pub(super) fn colon(input: ParseStream<'_>, name: &Ident, what: &str) -> syn::Result<()> {
    let place = input.span();
    let is_type = name.to_string().starts_with(char::is_uppercase);
    if is_type && let Ok(other) = input.fork().call(Ident::parse_any) {
        return Err(syn::Error::new(place, format!("the name comes first, then the type: `{other}: {name}`")));
    }
    if input.peek(syn::token::Paren) {
        let message = if is_type {
            format!("a name comes first, then the type, as in `name: {name}()`")
        } else {
            format!("expected `:` and {what} after `{name}`; parentheses follow the type, and hold its options")
        };
        return Err(syn::Error::new(place, message));
    }
    let colon: syn::Result<Token![:]> = input.parse();
    colon.map(drop).map_err(|_| syn::Error::new(place, format!("expected `:` and {what} after `{name}`")))
}

/// Skips to the next item, unless one starts here.
pub(super) fn skip_to_item(input: ParseStream<'_>) {
    let ahead = input.fork();
    if ahead.call(Attribute::parse_outer).is_err() || !starts_item(&ahead) {
        skip(input);
    }
}

fn head(input: ParseStream<'_>, expected: &str, notes: &mut Notes<'_>) -> syn::Result<Option<Head>> {
    let before = notes.count();
    let attributes = attributes(input, notes)?;
    if input.is_empty() && attributes.is_empty() && notes.count() > before {
        return Ok(None);
    }
    for attribute in attributes.iter().filter(|attribute| !attribute.path().is_ident("doc")) {
        let message = "only doc comments are allowed before a part of a robot; leave this attribute out";
        notes.error(attribute, message.into());
    }
    if input.peek(Token![pub]) && (input.peek2(Ident::peek_any) || input.peek2(syn::token::Paren)) {
        notes.at(input.span(), "the parts of a robot are as visible as the robot; leave `pub` out".into());
        input.parse::<syn::Visibility>()?;
    }
    let place = input.span();
    let expected = if input.peek(Token![<]) {
        "a robot is not written in XML; `topology: urdf(\"robot.urdf\");` takes links and joints from a URDF"
    } else {
        expected
    };
    let word = input.call(Ident::parse_any).map_err(|_| syn::Error::new(place, expected))?;
    Ok(Some(Head { attributes, word }))
}

/// Reads attributes and doc comments; comments of other languages are reported and skipped.
pub(super) fn attributes(input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Vec<Attribute>> {
    let mut attributes = Vec::new();
    let is_dashes = || input.peek(Token![-]) && input.peek2(Token![-]);
    while input.peek(Token![#]) || is_dashes() {
        if input.peek2(syn::token::Bracket) {
            attributes.extend(input.call(Attribute::parse_outer)?);
            continue;
        }
        let place = input.span();
        let message = if is_dashes() {
            "`--` does not start a comment; write `//`"
        } else if input.peek2(Token![!]) {
            "`//!` and `#![…]` cannot be used in a robot; write `///` before what it documents"
        } else {
            "`#` does not start a comment; write `//`"
        };
        notes.at(place, message.into());
        while input.span().start().line == place.start().line && input.parse::<TokenTree>().is_ok() {}
    }
    Ok(attributes)
}

/// Skips past the next `;` or `{ … }` of this level.
fn skip(input: ParseStream<'_>) {
    while !input.is_empty() {
        let Ok(token) = input.parse::<TokenTree>() else {
            return;
        };
        match token {
            TokenTree::Punct(punct) if punct.as_char() == ';' => return,
            TokenTree::Group(group) if group.delimiter() == Delimiter::Brace => {
                // A `;` after braces, as in `origin: { … };`, belongs to the same item; `items` passes it over.
                return;
            }
            _ => {}
        }
    }
}
