//! Values in braces and brackets: `{ field: value, … }`, `[1 m, 2 m]` and `[idle, executing]`.

use super::block::{braced, colon};
use super::name::one_name;
use super::quantity::decimal_comma;
use super::{Notes, Quantity};
use crate::diagnostics::Place;
use crate::language::{Word, Words, way_out};
use crate::names::{did_you_mean, one_of};
use proc_macro2::{Ident, TokenTree};
use syn::Token;
use syn::ext::IdentExt;
use syn::parse::ParseStream;

/// Reads the `{ field: value, … }` of a word; each field may be written once, in any order. `value` gets each field,
/// its word and the identifier as written.
pub(super) fn record<F: Words>(
    word: &Word,
    input: ParseStream<'_>,
    notes: &mut Notes<'_>,
    mut value: impl FnMut(F, &'static Word, &Ident, ParseStream<'_>, &mut Notes<'_>) -> syn::Result<()>,
) -> syn::Result<()> {
    let content = braced(input, word)?;
    let fields = F::texts();
    let mut seen: Vec<Ident> = Vec::new();
    while !content.is_empty() {
        let place = content.span();
        let expected = format!("expected {}", one_of(&fields));
        let name = content.call(Ident::parse_any).map_err(|_| syn::Error::new(place, &expected))?;
        let text = name.to_string();
        let Some((field_word, field)) = F::of(&text) else {
            let hint = match way_out(F::PLACE, &text) {
                Some(way) => format!("; {way}"),
                // With one field there is nothing to suggest.
                None if fields.len() > 1 => did_you_mean(&text, fields.iter().copied()),
                None => String::new(),
            };
            return Err(syn::Error::new(name.span(), format!("{expected}{hint}")));
        };
        if seen.contains(&name) {
            return Err(syn::Error::new(name.span(), format!("`{name}` is given twice; leave one out")));
        }
        colon(&content, &name, "a value")?;
        value(field, field_word, &name, &content, notes)?;
        seen.push(name);
        if !content.is_empty() {
            content.parse::<Token![,]>()?;
        }
    }
    Ok(())
}

/// Reads `, field` and `, field: value` up to the end of an item; `value` is called as for a record.
pub(super) fn properties<F: Words>(
    input: ParseStream<'_>,
    notes: &mut Notes<'_>,
    mut value: impl FnMut(F, &'static Word, &Ident, ParseStream<'_>, &mut Notes<'_>) -> syn::Result<()>,
) -> syn::Result<()> {
    let has_value = |word: &Word| !word.example.is_empty();
    while input.peek(Token![,]) {
        input.parse::<Token![,]>()?;
        let place = input.span();
        let forms =
            F::ALL.iter().map(|(word, _)| format!("{}{}", word.text, if has_value(word) { ": …" } else { "" }));
        let forms: Vec<String> = forms.collect();
        let expected = format!("expected {}", one_of(&forms.iter().map(String::as_str).collect::<Vec<_>>()));
        let name = input.call(Ident::parse_any).map_err(|_| syn::Error::new(place, &expected))?;
        let text = name.to_string();
        let Some((word, field)) = F::of(&text) else {
            let hint = did_you_mean(&text, F::texts());
            return Err(syn::Error::new(name.span(), format!("{expected}{hint}")));
        };
        if has_value(word) {
            colon(input, &name, "a value")?;
        } else if input.peek(Token![:]) || input.peek(Token![=]) {
            return Err(input.error(format!("`{name}` takes no value; write `, {name}` alone")));
        }
        value(field, word, &name, input, notes)?;
    }
    let place = input.span();
    match input.fork().call(Ident::parse_any) {
        Ok(word) if F::of(&word.to_string()).is_some() => {
            Err(syn::Error::new(place, format!("expected `,` before `{word}`")))
        }
        _ => Ok(()),
    }
}

/// Reads the `[a, b, …]` of a word, exactly `N` of them.
pub(super) fn array<const N: usize>(
    word: &'static Word,
    input: ParseStream<'_>,
    notes: &mut Notes<'_>,
) -> syn::Result<[Quantity; N]> {
    if !input.peek(syn::token::Bracket) {
        let message = format!("expected {N} values in brackets, as in `{}{}`", word.text, word.example);
        return Err(input.error(message));
    }
    let content;
    let bracket = syn::bracketed!(content in input);
    let ahead = content.fork();
    let quantities: Vec<Quantity> =
        content.parse_terminated(Quantity::parse_element, Token![,])?.into_iter().collect();
    let count = quantities.len();
    let quantities: [Quantity; N] = quantities.try_into().map_err(|_| {
        // If there are too many values, two without a space between them are one.
        let comma = if count > N { glued_comma(&ahead) } else { None };
        comma.unwrap_or_else(|| syn::Error::new(bracket.span.join(), format!("expected {N} values, found {count}")))
    })?;
    quantities.iter().for_each(|quantity| notes.give(word, quantity));
    Ok(quantities)
}

/// The error for the first number with a decimal comma.
fn glued_comma(input: ParseStream<'_>) -> Option<syn::Error> {
    while !input.is_empty() {
        if let Some(error) = decimal_comma(&input.fork())
            && is_glued(&input.fork())
        {
            return Some(error);
        }
        input.parse::<TokenTree>().ok()?;
    }
    None
}

/// Returns whether a comma and a number directly follow a number, without spaces.
fn is_glued(input: ParseStream<'_>) -> bool {
    let _: syn::Result<Option<Token![-]>> = input.parse();
    let tokens: Vec<Place> =
        (0..3).filter_map(|_| input.parse::<TokenTree>().ok()).map(|token| Place::of(&token)).collect();
    tokens.windows(2).all(|pair| matches!(pair, [first, second] if first.touches(second.start)))
}

/// Reads `[idle, executing]`: one or more names; `expected` is the error for none.
pub(super) fn names(input: ParseStream<'_>, expected: &str) -> syn::Result<Vec<Ident>> {
    if !input.peek(syn::token::Bracket) {
        return Err(input.error(expected));
    }
    let content;
    let bracket = syn::bracketed!(content in input);
    let mut names = Vec::new();
    while !content.is_empty() {
        names.push(one_name(&content, expected)?);
        if !content.is_empty() {
            content.parse::<Token![,]>()?;
        }
    }
    if names.is_empty() {
        return Err(syn::Error::new(bracket.span.join(), expected));
    }
    Ok(names)
}
