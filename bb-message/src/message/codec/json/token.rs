//! Single values of JSON, and the parts of an array or an object.

use super::wording::{Shortened, expected, found, mismatch};
use super::{INFINITY, JsonError, NAN, NEGATIVE_INFINITY};
use crate::message::codec::Shape;
use serde_core::de::{Deserialize, Deserializer, MapAccess, Visitor};
use serde_json::value::RawValue;
use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

/// An integer in that range. JSON has one type of numbers, so `1.0` and `1e2` are integers too, as long as a double holds
/// them exactly.
pub(super) fn integer(range: RangeInclusive<i128>, shape: Shape, value: &RawValue) -> Result<i128, JsonError> {
    /// 2⁵³. Below it every integer is a double, and no other decimal integer rounds to it.
    const EXACT: f64 = 9_007_199_254_740_992.0;
    let token = value.get();
    let number = match token.parse::<i128>() {
        Ok(number) => Some(number),
        Err(_) if !is_number(token) => None,
        Err(_) => {
            let number = token.parse::<f64>().ok();
            // The bounds make the cast exact.
            number.filter(|number| number.fract() == 0.0 && number.abs() < EXACT).map(|number| number as i128)
        }
    };
    number.filter(|number| range.contains(number)).ok_or_else(|| mismatch(shape, value))
}

pub(super) trait Float: FromStr {
    const NAN: Self;
    const INFINITY: Self;
    const NEGATIVE_INFINITY: Self;
    fn is_infinite(&self) -> bool;
}

macro_rules! float {
    ($($kind:ident),*) => { $(impl Float for $kind {
        const NAN: Self = $kind::NAN;
        const INFINITY: Self = $kind::INFINITY;
        const NEGATIVE_INFINITY: Self = $kind::NEG_INFINITY;
        fn is_infinite(&self) -> bool {
            $kind::is_infinite(*self)
        }
    })* };
}

float!(f32, f64);

/// The float nearest to a number.
pub(super) fn float<T: Float>(shape: Shape, value: &RawValue) -> Result<T, JsonError> {
    if let Some(text) = text_of(value) {
        return match text?.as_str() {
            NAN => Ok(T::NAN),
            INFINITY => Ok(T::INFINITY),
            NEGATIVE_INFINITY => Ok(T::NEGATIVE_INFINITY),
            _ => Err(mismatch(shape, value)),
        };
    }
    let token = value.get();
    match token.parse::<T>() {
        Ok(number) if is_number(token) => match number.is_infinite() {
            false => Ok(number),
            true => Err(JsonError::mismatch(expected(shape), format_args!("{}, which is too large", found(value)))),
        },
        _ => Err(mismatch(shape, value)),
    }
}

/// Rust also parses `inf` and `nan` as floats.
fn is_number(token: &str) -> bool {
    token.starts_with(|first: char| first == '-' || first.is_ascii_digit())
}

pub(super) fn string(shape: Shape, value: &RawValue) -> Result<String, JsonError> {
    text_of(value).unwrap_or_else(|| Err(mismatch(shape, value)))
}

/// The text of a string, with its escapes resolved. `None` if the value is not a string.
pub(super) fn text_of(value: &RawValue) -> Option<Result<String, JsonError>> {
    value.get().starts_with('"').then(|| {
        serde_json::from_str(value.get()).map_err(|error| {
            let reason = without_position(&error);
            JsonError::mismatch("text", format_args!("{} ({reason})", Shortened(value.get())))
        })
    })
}

pub(super) fn list(shape: Shape, value: &RawValue) -> Result<Vec<&RawValue>, JsonError> {
    match value.get().starts_with('[') {
        true => serde_json::from_str(value.get()).map_err(syntax),
        false => Err(mismatch(shape, value)),
    }
}

/// The members of an object in their order, including repeated ones. `None` if the value is not an object.
pub(super) fn members(value: &RawValue) -> Option<Result<Vec<(String, &RawValue)>, JsonError>> {
    value.get().starts_with('{').then(|| match serde_json::from_str(value.get()) {
        Ok(Members(members)) => Ok(members),
        Err(error) => Err(JsonError::new(format!("invalid field name ({})", without_position(&error)))),
    })
}

/// The value of a member of an object, both as JSON.
pub fn member_of(object: &str, name: &str) -> Option<String> {
    let members = members_of(object)?;
    members.into_iter().find(|(member, _)| member == name).map(|(_, value)| value.get().to_owned())
}

/// The members of an object that is JSON.
pub fn members_of(object: &str) -> Option<Vec<(String, &RawValue)>> {
    members(serde_json::from_str(object).ok()?)?.ok()
}

/// The elements of an array that is JSON.
pub fn elements_of(array: &str) -> Option<Vec<&RawValue>> {
    serde_json::from_str(array).ok()
}

struct Members<'a>(Vec<(String, &'a RawValue)>);

impl<'de> Deserialize<'de> for Members<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Collect;
        impl<'de> Visitor<'de> for Collect {
            type Value = Members<'de>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object")
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut members = Vec::new();
                while let Some(member) = map.next_entry()? {
                    members.push(member);
                }
                Ok(Members(members))
            }
        }
        deserializer.deserialize_map(Collect)
    }
}

pub(super) fn syntax(error: serde_json::Error) -> JsonError {
    let reason = without_position(&error);
    JsonError::new(format!("line {}, column {}: {reason}", error.line(), error.column()))
}

/// serde_json appends the position. For a part of the text it is not the position in the whole text.
fn without_position(error: &serde_json::Error) -> String {
    let text = error.to_string();
    match text.rfind(" at line ") {
        Some(end) => text[..end].to_owned(),
        None => text,
    }
}
