//! Values in braces and brackets: `{ field: value, … }`, `[1 m, 2 m]` and `[idle, executing]`.

use super::Quantity;
use super::block::{braced, colon};
use super::quantity::decimal_comma;
use crate::diagnostics::Place;
use crate::names::{did_you_mean, one_of};
use proc_macro2::{Ident, TokenTree};
use syn::Token;
use syn::ext::IdentExt;
use syn::parse::{Parse, ParseStream};

/// Reads `{ field: value, … }` as in `example`; each of `fields` may stand in it once, in any order. `value` gets each field's name.
pub(super) fn record(
    input: ParseStream<'_>,
    example: &str,
    fields: &[&str],
    mut value: impl FnMut(&Ident, ParseStream<'_>) -> syn::Result<()>,
) -> syn::Result<()> {
    let content = braced(input, example)?;
    let mut seen: Vec<Ident> = Vec::new();
    while !content.is_empty() {
        let place = content.span();
        let expected = format!("expected {}", one_of(fields));
        let name = content.call(Ident::parse_any).map_err(|_| syn::Error::new(place, &expected))?;
        let text = name.to_string();
        if !fields.contains(&&*text) {
            // One field is no choice.
            let hint = if fields.len() > 1 { did_you_mean(&text, fields.iter().copied()) } else { String::new() };
            return Err(syn::Error::new(name.span(), format!("{expected}{hint}")));
        }
        if seen.contains(&name) {
            return Err(syn::Error::new(name.span(), format!("`{name}` stands here twice; leave one out")));
        }
        colon(&content, &name, "a value")?;
        value(&name, &content)?;
        seen.push(name);
        if !content.is_empty() {
            content.parse::<Token![,]>()?;
        }
    }
    Ok(())
}

/// Reads `[a, b, …]`, exactly `N` of them.
pub(super) fn array<const N: usize>(input: ParseStream<'_>) -> syn::Result<[Quantity; N]> {
    let content;
    let bracket = syn::bracketed!(content in input);
    let ahead = content.fork();
    let quantities: Vec<Quantity> =
        content.parse_terminated(Quantity::parse_element, Token![,])?.into_iter().collect();
    let count = quantities.len();
    quantities.try_into().map_err(|_| {
        // Of too many values, two without a blank between them are one.
        let comma = if count > N { glued_comma(&ahead) } else { None };
        comma.unwrap_or_else(|| syn::Error::new(bracket.span.join(), format!("expected {N} values, found {count}")))
    })
}

/// The error for the first number that is written with a comma.
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

/// Whether a comma and a number follow a number without blanks.
fn is_glued(input: ParseStream<'_>) -> bool {
    let _: syn::Result<Option<Token![-]>> = input.parse();
    let tokens: Vec<Place> =
        (0..3).filter_map(|_| input.parse::<TokenTree>().ok()).map(|token| Place::of(&token)).collect();
    tokens.windows(2).all(|pair| matches!(pair, [first, second] if first.touches(second.start)))
}

/// Reads `[idle, executing]`: one name or more; `expected` is the error for none.
pub(super) fn names(input: ParseStream<'_>, expected: &str) -> syn::Result<Vec<Ident>> {
    let content;
    let bracket = syn::bracketed!(content in input);
    let names: Vec<Ident> = content.parse_terminated(Ident::parse, Token![,])?.into_iter().collect();
    if names.is_empty() {
        return Err(syn::Error::new(bracket.span.join(), expected));
    }
    Ok(names)
}
