//! Names that a robot declares, and errors for other tokens in their place.

use crate::diagnostics::Place;
use proc_macro2::{Ident, TokenStream, TokenTree};
use syn::ext::IdentExt;
use syn::parse::ParseStream;
use syn::{Lit, LitStr, Token};

/// Reads a name; `word` declares it.
pub(super) fn name(input: ParseStream<'_>, word: &Ident) -> syn::Result<Ident> {
    let place = input.span();
    if input.peek(Lit) {
        let literal: Lit = input.parse()?;
        let message = no_name(&literal).unwrap_or_else(|| expected(word));
        return Err(syn::Error::new(place, message));
    }
    let name = input.call(Ident::parse_any).map_err(|_| syn::Error::new(place, expected(word)))?;
    whole_of(input, &name, word == "robot")?;
    if let Some(words) = spaced(input, &name, word) {
        return Err(joined(&words, word == "robot"));
    }
    if name == "_" {
        return Err(syn::Error::new(place, expected(word)));
    }
    if is_keyword(&name) {
        let message = format!("`{name}` is a keyword of Rust; choose another name, as in `{name}_{word}`");
        return Err(syn::Error::new(place, message));
    }
    Ok(name)
}

/// Reads a name that is declared elsewhere; `expected` is the error for anything else.
pub(super) fn one_name(input: ParseStream<'_>, expected: &str) -> syn::Result<Ident> {
    let place = input.span();
    if input.peek(LitStr) {
        let text: LitStr = input.parse()?;
        let message = no_name(&Lit::Str(text)).unwrap_or_else(|| expected.to_owned());
        return Err(syn::Error::new(place, message));
    }
    input.parse().map_err(|_| syn::Error::new(place, expected))
}

/// Checks that the name just read ends here: `left-wheel` does not.
pub(super) fn whole(input: ParseStream<'_>, name: &Ident) -> syn::Result<()> {
    whole_of(input, name, false)
}

fn whole_of(input: ParseStream<'_>, name: &Ident, is_type: bool) -> syn::Result<()> {
    let ahead = input.fork();
    let mut parts = vec![TokenTree::from(name.clone())];
    while let Some(part) = joined_part(&ahead) {
        parts.push(part);
    }
    if parts.len() > 1 { Err(joined(&parts, is_type)) } else { Ok(()) }
}

pub(super) fn is_keyword(name: &Ident) -> bool {
    syn::parse_str::<Ident>(&name.to_string()).is_err()
}

fn expected(word: &Ident) -> String {
    format!("expected the name of this `{word}`")
}

/// Returns what to write instead of a literal: `2tyre`, `"base"`.
fn no_name(literal: &Lit) -> Option<String> {
    match literal {
        Lit::Int(number) if !number.suffix().is_empty() => {
            let text = number.to_string();
            let (digits, rest) = text.split_at(text.find(char::is_alphabetic)?);
            let digits = digits.trim_matches('_');
            Some(format!("a name starts with a letter, not with a digit; try `{rest}{digits}`"))
        }
        Lit::Str(text) => {
            let text = text.value();
            let is_name = syn::parse_str::<Ident>(&text).is_ok();
            is_name.then(|| format!("a name is written without quotes: `{text}`"))
        }
        _ => None,
    }
}

/// Reads the next part of a name that is joined by characters not allowed in names.
fn joined_part(input: ParseStream<'_>) -> Option<TokenTree> {
    if input.peek(Token![->]) {
        return None;
    } else if input.peek(Token![-]) {
        input.parse::<Token![-]>().ok()?;
    } else if input.peek(Token![.]) {
        input.parse::<Token![.]>().ok()?;
    } else if input.peek(Token![/]) {
        input.parse::<Token![/]>().ok()?;
    } else {
        return None;
    }
    input.parse().ok()
}

/// The words of a name with spaces, `left wheel`, if the tokens after them could follow a name.
fn spaced(input: ParseStream<'_>, name: &Ident, word: &Ident) -> Option<Vec<TokenTree>> {
    let ahead = input.fork();
    let mut words = vec![TokenTree::from(name.clone())];
    while let Ok(next) = ahead.call(Ident::parse_any) {
        if crate::language::starts_item(&next.to_string()) {
            return None;
        }
        words.push(next.into());
    }
    let has_braces = word == "link" || word == "category" || word == "robot";
    let ends = if has_braces {
        ahead.peek(Token![;]) || ahead.peek(syn::token::Brace)
    } else {
        ahead.peek(Token![:]) && !ahead.peek(Token![::])
    };
    (ends && words.len() > 1).then_some(words)
}

fn joined(parts: &[TokenTree], is_type: bool) -> syn::Error {
    let place = Place::of(&parts.iter().cloned().collect::<TokenStream>());
    let parts = parts.iter().map(ToString::to_string);
    let name =
        if is_type { parts.map(|part| capitalized(&part)).collect() } else { parts.collect::<Vec<_>>().join("_") };
    place.syntax(format!("a name consists of letters, digits and `_`; try `{name}`"))
}

fn capitalized(text: &str) -> String {
    let mut characters = text.chars();
    let first = characters.next().into_iter().flat_map(char::to_uppercase);
    first.chain(characters).collect()
}
