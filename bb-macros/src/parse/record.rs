//! Values in braces and brackets: `{ field: value, … }`, `[1 m, 2 m]` and `[idle, executing]`.

use super::Quantity;
use super::block::{braced, colon};
use crate::names::{did_you_mean, one_of};
use proc_macro2::Ident;
use syn::Token;
use syn::ext::IdentExt;
use syn::parse::{Parse, ParseStream};

/// Reads `{ field: value, … }`; each of `fields` may stand in it once, in any order. `value` gets each field's name.
pub(super) fn record(
    input: ParseStream<'_>,
    fields: &[&str],
    mut value: impl FnMut(&Ident, ParseStream<'_>) -> syn::Result<()>,
) -> syn::Result<()> {
    let content = braced(input)?;
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
    let quantities: Vec<Quantity> = content.parse_terminated(Quantity::parse, Token![,])?.into_iter().collect();
    let count = quantities.len();
    quantities
        .try_into()
        .map_err(|_| syn::Error::new(bracket.span.join(), format!("expected {N} values, found {count}")))
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
