//! Where a joint stands, about what it moves, and how far.

use crate::diagnostics::{Diagnostics, Place};
use crate::parse::Quantity;
use crate::parse::block::{Head, colon, place_since, semicolon};
use crate::parse::record::{array, record};
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
        colon(input, &head.word, "its fields in braces")?;
        let origin = Self::parse_value(head.word, input)?;
        semicolon(input, "`origin`", diagnostics);
        Ok(origin)
    }

    /// Reads `{ xyz: […], rpy: […] }`.
    pub(in crate::parse) fn parse_value(word: Ident, input: ParseStream<'_>) -> syn::Result<Self> {
        let mut origin = Self { word, xyz: None, rpy: None };
        record(
            input,
            "{ xyz: [0 m, 0 m, 0.9 m], rpy: [0 deg, 0 deg, 90 deg] }",
            &["xyz", "rpy"],
            |field, input| {
                let triple = array(input)?;
                if field == "xyz" {
                    origin.xyz = Some(triple);
                } else {
                    origin.rpy = Some(triple);
                }
                Ok(())
            },
        )?;
        Ok(origin)
    }
}

impl Axis {
    /// The direction at unit length; one that has it already is kept as it is.
    pub(crate) fn unit(&self) -> [f64; 3] {
        let length = self.direction.iter().map(|value| value * value).sum::<f64>().sqrt();
        if (length - 1.0).abs() < 1e-12 { self.direction } else { self.direction.map(|value| value / length) }
    }

    pub(super) fn parse(head: Head, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<Self> {
        colon(input, &head.word, "a direction")?;
        let (start, place) = (input.cursor(), input.span());
        let (direction, components) = if input.peek(syn::token::Bracket) {
            let components = array::<3>(input)?;
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
        colon(input, &head.word, "its fields in braces")?;
        let mut limit = Self { word: head.word, lower: None, upper: None, velocity: None, effort: None };
        record(
            input,
            "{ lower: -90 deg, upper: 90 deg }",
            &["lower", "upper", "velocity", "effort"],
            |field, input| {
                let quantity = Some(Quantity::parse(input)?);
                match &*field.to_string() {
                    "lower" => limit.lower = quantity,
                    "upper" => limit.upper = quantity,
                    "velocity" => limit.velocity = quantity,
                    _ => limit.effort = quantity,
                }
                Ok(())
            },
        )?;
        semicolon(input, "`limit`", diagnostics);
        Ok(limit)
    }
}
