//! JSON and a shape to bytes.
//!
//! `serde_json` checks the syntax of the whole text, then splits it level by level as the shape requires. The
//! recursion is therefore as deep as the shape, no matter how deeply the text is nested.

use super::token::{float, integer, list, members, string, syntax, text_of};
use super::wording::{Quoted, did_you_mean, expected, found, mismatch, unknown};
use super::{Form, JsonError, range};
use crate::message::codec::{EnumShape, Field, FieldShape, Shape, StructShape, Writer, decode};
use serde_json::value::RawValue;

/// A value from JSON, in the form that [`to_json`](super::to_json) writes.
///
/// An `Option` may be left out of an object; every other field is required. Unknown and repeated fields are errors. A
/// struct without fields is read from `{}`, from `null` and from empty text.
///
/// ```
/// use bb_core::message::codec::from_json;
/// use bb_core::prelude::*;
///
/// /// Arguments of a command.
/// #[derive(Clone, Debug, PartialEq, Payload)]
/// struct DriveTo {
///     /// Distance, m.
///     distance: f64,
///     /// Speed, m/s.
///     speed: Option<f64>,
/// }
///
/// assert_eq!(from_json(r#"{"distance": 2}"#), Ok(DriveTo { distance: 2.0, speed: None }));
///
/// let error = from_json::<DriveTo>(r#"{"distnace": 2}"#).unwrap_err();
/// assert_eq!(error.to_string(), "distnace: unknown field; did you mean `distance`?");
/// ```
///
/// # Errors
/// The field that is wrong, by its path, and what was expected there.
pub fn from_json<T: Field>(text: &str) -> Result<T, JsonError> {
    Ok(decode(&json_to_bytes(text, T::SHAPE)?)?)
}

/// The bytes that [`encode`](super::super::encode) writes for the value described by JSON, without its type.
/// Restrictions of the type itself are not checked, such as a `Duration` with 10⁹ or more in its nanoseconds.
///
/// # Errors
/// As for [`from_json`].
pub fn json_to_bytes(text: &str, shape: Shape) -> Result<Vec<u8>, JsonError> {
    let mut bytes = Vec::new();
    let mut writer = Writer::of_message(&mut bytes);
    if text.trim_ascii().is_empty() {
        nothing(shape, &mut writer)?;
    } else {
        read(shape, serde_json::from_str(text).map_err(syntax)?, &mut writer)?;
    }
    Ok(bytes)
}

fn nothing(shape: Shape, writer: &mut Writer<'_>) -> Result<(), JsonError> {
    match shape {
        Shape::Struct(of) if matches!(Form::of(of.fields), Form::Empty) => {
            writer.nothing();
            Ok(())
        }
        other => Err(JsonError::mismatch(expected(other), "nothing")),
    }
}

fn read(shape: Shape, value: &RawValue, writer: &mut Writer<'_>) -> Result<(), JsonError> {
    let token = value.get();
    if let Some(range) = range(shape) {
        let number = integer(range, shape, value)?;
        match shape {
            Shape::I8 | Shape::U8 | Shape::Byte => (number as u8).write(writer),
            Shape::I16 | Shape::U16 => (number as u16).write(writer),
            Shape::I32 | Shape::U32 => (number as u32).write(writer),
            _ => (number as u64).write(writer),
        }
        return Ok(());
    }
    match shape {
        Shape::Bool => match token {
            "true" => writer.raw(&[1]),
            "false" => writer.raw(&[0]),
            _ => return Err(mismatch(shape, value)),
        },
        Shape::Char => {
            let text = string(shape, value)?;
            let mut letters = text.chars();
            match (letters.next(), letters.next()) {
                (Some(letter), None) => letter.write(writer),
                _ => return Err(mismatch(shape, value)),
            }
        }
        Shape::F32 => float::<f32>(shape, value)?.write(writer),
        Shape::Text => writer.text(&string(shape, value)?),
        Shape::Option(_) if token == "null" => writer.length(0),
        Shape::Option(of) => {
            writer.length(1);
            read(*of, value, writer)?;
        }
        Shape::List(of) => {
            let values = list(shape, value)?;
            writer.length(values.len());
            elements(*of, &values, writer)?;
        }
        Shape::Array(of, length) => {
            let values = list(shape, value)?;
            if values.len() != length {
                return Err(JsonError::mismatch(expected(shape), format_args!("an array of {}", values.len())));
            }
            elements(*of, &values, writer)?;
        }
        Shape::Struct(of) => object(of.fields, value, writer)?,
        Shape::Enum(of) => variant(of, value, writer)?,
        // Integers are above.
        _ => float::<f64>(shape, value)?.write(writer),
    }
    Ok(())
}

fn elements(of: Shape, values: &[&RawValue], writer: &mut Writer<'_>) -> Result<(), JsonError> {
    for (index, value) in values.iter().enumerate() {
        read(of, value, writer).map_err(|error| error.at_index(index))?;
    }
    Ok(())
}

fn object(fields: &'static [FieldShape], value: &RawValue, writer: &mut Writer<'_>) -> Result<(), JsonError> {
    let fields = match Form::of(fields) {
        Form::Transparent(shape) => return read(shape, value, writer),
        Form::Empty => &[],
        Form::Object(fields) => fields,
    };
    let members = match value.get() {
        "null" if fields.is_empty() => Vec::new(),
        _ => members(value).unwrap_or_else(|| Err(JsonError::mismatch("an object", found(value))))?,
    };
    // The bytes have the order of the shape; JSON has any.
    let mut values: Vec<Option<&RawValue>> = vec![None; fields.len()];
    for (name, value) in members {
        let index = fields.iter().position(|field| field.name == name);
        match index.and_then(|index| values.get_mut(index)) {
            None => return Err(unknown(fields, name)),
            Some(Some(_)) => return Err(JsonError::new("given twice").within(name)),
            Some(free) => *free = Some(value),
        }
    }
    for (field, value) in fields.iter().zip(values) {
        match value {
            Some(value) => read(field.shape, value, writer).and_then(|()| in_range(field, value)),
            None if is_optional(field.shape) => {
                writer.length(0);
                Ok(())
            }
            None => Err(JsonError::new("missing")),
        }
        .map_err(|error| error.within(field.name))?;
    }
    if fields.is_empty() {
        writer.nothing();
    }
    Ok(())
}

/// Checks a number, or null, that was read.
fn in_range(field: &FieldShape, value: &RawValue) -> Result<(), JsonError> {
    let (Some(range), token) = (field.range, value.get()) else { return Ok(()) };
    let (minimum, maximum) = (range.minimum(), range.maximum());
    match token.parse::<f64>() {
        _ if token == "null" => Ok(()),
        Ok(number) if (minimum..=maximum).contains(&number) => Ok(()),
        _ => Err(JsonError::mismatch(format_args!("a number from {minimum} to {maximum}"), found(value))),
    }
}

/// An `Option`, also in a tuple struct of its own.
pub(super) fn is_optional(shape: Shape) -> bool {
    match shape {
        Shape::Option(_) => true,
        Shape::Struct(of) => match Form::of(of.fields) {
            Form::Transparent(shape) => is_optional(shape),
            Form::Empty | Form::Object(_) => false,
        },
        _ => false,
    }
}

fn variant(of: &'static EnumShape, value: &RawValue, writer: &mut Writer<'_>) -> Result<(), JsonError> {
    let (name, fields) = match text_of(value) {
        Some(name) => (name?, None),
        None => {
            let mut members = members(value).unwrap_or_else(|| Err(mismatch(Shape::Enum(of), value)))?;
            match (members.pop(), members.is_empty()) {
                (Some((name, fields)), true) => (name, Some(fields)),
                (None, _) => return Err(mismatch(Shape::Enum(of), value)),
                (Some(_), false) => return Err(JsonError::mismatch(expected(Shape::Enum(of)), "several fields")),
            }
        }
    };
    let Some((index, variant)) = of.variants.iter().enumerate().find(|(_, variant)| variant.name == name) else {
        let names: Vec<&str> = of.variants.iter().map(|variant| variant.name).collect();
        let hint = did_you_mean(&names, &name);
        return Err(JsonError::new(format!(
            "expected {}, found {}{hint}",
            expected(Shape::Enum(of)),
            Quoted(&name)
        )));
    };
    let is_list = |variant: &&StructShape| !variant.fields.is_empty();
    let before = of.variants.iter().take(index).filter(is_list).count();
    let after = of.variants.iter().skip(index + 1).filter(is_list).count();
    // An enum with more than `u32::MAX` variants does not compile in a lifetime.
    writer.variant(u32::try_from(index).unwrap_or(u32::MAX), before);
    match (variant.fields.is_empty(), fields) {
        (true, None) => {}
        (false, Some(fields)) => {
            writer.present();
            object(variant.fields, fields, writer).map_err(|error| error.within(variant.name))?;
        }
        (true, Some(_)) => return Err(JsonError::new("has no fields; write its name alone").within(variant.name)),
        (false, None) => {
            let reason = format!("its fields are missing; write {{{}: …}}", Quoted(variant.name));
            return Err(JsonError::new(reason).within(variant.name));
        }
    }
    writer.absent(after);
    Ok(())
}
