//! Where a joint stands, about what it moves, and how far.

use crate::diagnostics::{Diagnostics, Place};
use crate::names::did_you_mean;
use crate::parse::Quantity;
use crate::parse::block::{Head, braced, colon, place_since, semicolon};
use proc_macro2::Ident;
use syn::Token;
use syn::ext::IdentExt;
use syn::parse::ParseStream;

/// `origin: { xyz: [0 m, 0 m, 0.9 m], rpy: [0 deg, 0 deg, 45 deg] };`
#[derive(Clone, Debug)]
pub(crate) struct Origin {
    pub(crate) word: Ident,
    pub(crate) xyz: Option<[Quantity; 3]>,
    pub(crate) rpy: Option<[Quantity; 3]>,
}

/// `axis: -z;` or `axis: [0, 0.6, 0.8];`
#[derive(Clone, Debug)]
pub(crate) struct Axis {
    pub(crate) word: Ident,
    /// As written, not yet of unit length.
    pub(crate) direction: [f64; 3],
    /// The components, if they were written as numbers: none of them has a unit.
    pub(crate) components: Vec<Quantity>,
    pub(crate) place: Place,
}

/// `limit: { lower: -90 deg, upper: 90 deg, velocity: 60 deg/s, effort: 5 N*m };`
#[derive(Clone, Debug)]
pub(crate) struct Limit {
    pub(crate) word: Ident,
    pub(crate) lower: Option<Quantity>,
    pub(crate) upper: Option<Quantity>,
    pub(crate) velocity: Option<Quantity>,
    pub(crate) effort: Option<Quantity>,
}

impl Origin {
    pub(super) fn parse(head: Head, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<Self> {
        let mut origin = Self { word: head.word, xyz: None, rpy: None };
        record(&origin.word.clone(), input, &["xyz", "rpy"], |field, input| {
            let triple = triple(input)?;
            match field {
                "xyz" => origin.xyz = Some(triple),
                _ => origin.rpy = Some(triple),
            }
            Ok(())
        })?;
        semicolon(input, "`origin`", diagnostics);
        Ok(origin)
    }
}

impl Axis {
    pub(super) fn parse(head: Head, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<Self> {
        colon(input, &head.word, "a direction")?;
        let (start, place) = (input.cursor(), input.span());
        let (direction, components) = if input.peek(syn::token::Bracket) {
            let components = triple(input)?;
            let direction = components.each_ref().map(|component| component.value);
            (direction, components.to_vec())
        } else {
            let sign = if input.peek(Token![-]) {
                input.parse::<Token![-]>()?;
                -1.0
            } else {
                1.0
            };
            let word = input.call(Ident::parse_any).map_err(|_| syn::Error::new(place, AXIS))?;
            let direction = match &*word.to_string() {
                "x" => [sign, 0.0, 0.0],
                "y" => [0.0, sign, 0.0],
                "z" => [0.0, 0.0, sign],
                _ => return Err(syn::Error::new(word.span(), AXIS)),
            };
            (direction, Vec::new())
        };
        let place = place_since(start, input);
        semicolon(input, "`axis`", diagnostics);
        Ok(Self { word: head.word, direction, components, place })
    }
}

const AXIS: &str = "expected `x`, `y`, `z`, one of them with `-`, or `[a, b, c]`";

impl Limit {
    pub(super) fn parse(head: Head, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<Self> {
        let mut limit = Self { word: head.word, lower: None, upper: None, velocity: None, effort: None };
        record(&limit.word.clone(), input, &["lower", "upper", "velocity", "effort"], |field, input| {
            let quantity = Some(Quantity::parse(input)?);
            match field {
                "lower" => limit.lower = quantity,
                "upper" => limit.upper = quantity,
                "velocity" => limit.velocity = quantity,
                _ => limit.effort = quantity,
            }
            Ok(())
        })?;
        semicolon(input, "`limit`", diagnostics);
        Ok(limit)
    }
}

/// Reads `: { field: value, … }`.
fn record(
    word: &Ident,
    input: ParseStream<'_>,
    fields: &[&str],
    mut value: impl FnMut(&str, ParseStream<'_>) -> syn::Result<()>,
) -> syn::Result<()> {
    colon(input, word, "its fields in braces")?;
    let content = braced(input)?;
    let mut seen: Vec<String> = Vec::new();
    while !content.is_empty() {
        let place = content.span();
        let expected = format!("expected {}", crate::names::one_of(fields));
        let word = content.call(Ident::parse_any).map_err(|_| syn::Error::new(place, &expected))?;
        let name = word.to_string();
        if !fields.contains(&&*name) {
            let hint = did_you_mean(&name, fields.iter().copied());
            return Err(syn::Error::new(word.span(), format!("{expected}{hint}")));
        }
        if seen.contains(&name) {
            return Err(syn::Error::new(word.span(), format!("`{name}` stands here twice; leave one out")));
        }
        colon(&content, &word, "a value")?;
        value(&name, &content)?;
        seen.push(name);
        if !content.is_empty() {
            content.parse::<Token![,]>()?;
        }
    }
    Ok(())
}

fn triple(input: ParseStream<'_>) -> syn::Result<[Quantity; 3]> {
    let content;
    let bracket = syn::bracketed!(content in input);
    let quantities: Vec<Quantity> = content.parse_terminated(Quantity::parse, Token![,])?.into_iter().collect();
    let count = quantities.len();
    quantities
        .try_into()
        .map_err(|_| syn::Error::new(bracket.span.join(), format!("expected three values, found {count}")))
}
