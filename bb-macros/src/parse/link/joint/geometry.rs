//! Origin, axis and limits of a joint.

use crate::diagnostics::Place;
use crate::language::{LimitField, OriginField, Word, words};
use crate::parse::block::{Head, colon, semicolon};
use crate::parse::record::{array, record};
use crate::parse::tokens::place_since;
use crate::parse::{Notes, Quantity};
use proc_macro2::Ident;
use syn::Token;
use syn::ext::IdentExt;
use syn::parse::ParseStream;

/// `origin: { xyz: [0 m, 0 m, 0.9 m], rpy: [0 deg, 0 deg, 45 deg] };`
#[derive(Clone, Debug)]
pub(crate) struct Origin {
    pub(crate) xyz: Option<[Quantity; 3]>,
    pub(crate) rpy: Option<[Quantity; 3]>,
}

/// `axis: -z;` or `axis: [0, 0.6, 0.8];`
#[derive(Clone, Debug)]
pub(crate) struct Axis {
    pub(crate) word: Ident,
    /// Direction as written, not yet of unit length.
    pub(crate) direction: [f64; 3],
    /// The components, if they were written as numbers; they have no unit.
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
    pub(super) fn parse(head: Head, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        colon(input, &head.word, "its fields in braces")?;
        let origin = Self::parse_value(&words::ORIGIN, input, notes)?;
        semicolon(input, "`origin`", notes);
        Ok(origin)
    }

    /// Reads `{ xyz: […], rpy: […] }`.
    pub(in crate::parse) fn parse_value(
        word: &Word,
        input: ParseStream<'_>,
        notes: &mut Notes<'_>,
    ) -> syn::Result<Self> {
        let mut origin = Self { xyz: None, rpy: None };
        record(word, input, notes, |field, word, _, input, notes| {
            match field {
                OriginField::Xyz => origin.xyz = Some(array(word, input, notes)?),
                OriginField::Rpy => origin.rpy = Some(array(word, input, notes)?),
            }
            Ok(())
        })?;
        Ok(origin)
    }
}

impl Axis {
    /// The direction as a unit vector; one with unit length is not changed.
    pub(crate) fn unit(&self) -> [f64; 3] {
        let length = self.direction.iter().map(|value| value * value).sum::<f64>().sqrt();
        if (length - 1.0).abs() < 1e-12 { self.direction } else { self.direction.map(|value| value / length) }
    }

    pub(super) fn parse(head: Head, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        colon(input, &head.word, "a direction")?;
        let (start, place) = (input.cursor(), input.span());
        let (direction, components) = if input.peek(syn::token::Bracket) {
            let components = array::<3>(&words::AXIS_COMPONENT, input, notes)?;
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
        semicolon(input, "`axis`", notes);
        Ok(Self { word: head.word, direction, components, place })
    }
}

const AXIS: &str = "expected `x`, `y`, `z`, one of them with `-`, or `[a, b, c]`";

impl Limit {
    pub(super) fn parse(head: Head, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        colon(input, &head.word, "its fields in braces")?;
        let mut limit = Self { word: head.word, lower: None, upper: None, velocity: None, effort: None };
        record(&words::LIMIT, input, notes, |field, word, _, input, notes| {
            let slot = match field {
                LimitField::Lower => &mut limit.lower,
                LimitField::Upper => &mut limit.upper,
                LimitField::Velocity => &mut limit.velocity,
                LimitField::Effort => &mut limit.effort,
            };
            *slot = Some(notes.number(word, input)?);
            Ok(())
        })?;
        semicolon(input, "`limit`", notes);
        Ok(limit)
    }
}
