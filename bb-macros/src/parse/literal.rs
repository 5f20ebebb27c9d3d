//! Literal values: a number with or without its unit, a string, `true` or `false`.

use super::Quantity;
use super::quantity::decimal_comma;
use super::tokens::{place_since, starts_item};
use crate::diagnostics::Place;
use crate::units::Dimension;
use proc_macro2::Ident;
use syn::ext::IdentExt;
use syn::parse::ParseStream;
use syn::{Lit, Token};

#[derive(Clone, Debug)]
pub(crate) struct Literal {
    pub(crate) value: Value,
    /// Dimension, if the literal is a number.
    pub(crate) dimension: Dimension,
    /// `true` if a unit was written.
    pub(crate) has_unit: bool,
    pub(crate) place: Place,
}

/// A value of one of the parameter types.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Value {
    Bool(bool),
    /// A number without a fraction and without a unit.
    Integer(i64),
    /// A number, in SI.
    Number(f64),
    Text(String),
}

impl Literal {
    pub(super) fn parse(input: ParseStream<'_>) -> syn::Result<Self> {
        let (start, place) = (input.cursor(), input.span());
        decimal_comma(&input.fork()).map_or(Ok(()), Err)?;
        let value = if let Some(integer) = integer(input) {
            input.parse::<Option<Token![-]>>()?;
            input.parse::<Lit>()?;
            Value::Integer(integer)
        } else if Quantity::peek(input) {
            let Quantity { value, dimension, has_unit, place } = Quantity::parse(input)?;
            return Ok(Self { value: Value::Number(value), dimension, has_unit, place });
        } else {
            capitalized(&input.fork()).map_or(Ok(()), Err)?;
            match input.parse() {
                Ok(Lit::Bool(value)) => Value::Bool(value.value),
                Ok(Lit::Str(value)) => Value::Text(value.value()),
                _ => {
                    let message = "expected a number, a text in quotes, `true` or `false`";
                    return Err(syn::Error::new(place, message));
                }
            }
        };
        Ok(Self { value, dimension: Dimension::NONE, has_unit: false, place: place_since(start, input) })
    }
}

/// The error for Python's `True` and `False`, if one starts here.
pub(super) fn capitalized(input: ParseStream<'_>) -> Option<syn::Error> {
    let word: Ident = input.parse().ok()?;
    let lower = match &*word.to_string() {
        "True" | "TRUE" => "true",
        "False" | "FALSE" => "false",
        _ => return None,
    };
    Some(syn::Error::new(word.span(), format!("`{word}` is written `{lower}`")))
}

/// The next integer, if it has no unit and fits.
fn integer(input: ParseStream<'_>) -> Option<i64> {
    let ahead = input.fork();
    let sign = if ahead.parse::<Option<Token![-]>>().ok()?.is_some() { "-" } else { "" };
    let Ok(Lit::Int(literal)) = ahead.parse() else { return None };
    let has_unit = !literal.suffix().is_empty() || ahead.peek(Ident::peek_any) && !starts_item(&ahead);
    if has_unit { None } else { format!("{sign}{}", literal.base10_digits()).parse().ok() }
}
