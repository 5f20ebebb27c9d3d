//! Bytes and their shape to JSON.

use super::{Form, INFINITY, NAN, NEGATIVE_INFINITY};
use crate::message::codec::{DecodeError, EnumShape, Field, FieldShape, Reader, Shape, Writer};
use std::fmt::Write as _;

/// A value as JSON. [`from_json`](super::from_json) reads it back.
pub fn to_json<T: Field>(value: &T) -> String {
    let mut bytes = Vec::new();
    value.write(&mut Writer::new(&mut bytes));
    written_to_json(&bytes, T::SHAPE)
}

fn written_to_json(bytes: &[u8], shape: Shape) -> String {
    let mut json = String::new();
    // Bytes written just now can be read.
    let _ = write(shape, &mut Reader::new(bytes), &mut json);
    json
}

/// The bytes that [`encode`](super::super::encode) wrote for a value of this shape, as JSON.
///
/// # Errors
/// The bytes do not have this shape.
pub fn bytes_to_json(bytes: &[u8], shape: Shape) -> Result<String, DecodeError> {
    let mut reader = Reader::of_message(bytes)?;
    let mut json = String::new();
    write(shape, &mut reader, &mut json)?;
    reader.end_message()?;
    Ok(json)
}

fn write(shape: Shape, reader: &mut Reader<'_>, json: &mut String) -> Result<(), DecodeError> {
    match shape {
        Shape::Bool => json.push_str(if bool::read(reader)? { "true" } else { "false" }),
        Shape::Char => text(char::read(reader)?.encode_utf8(&mut [0; 4]), json),
        Shape::I8 => number(i8::read(reader)?.into(), json),
        Shape::I16 => number(i16::read(reader)?.into(), json),
        Shape::I32 => number(i32::read(reader)?.into(), json),
        Shape::I64 => number(i64::read(reader)?.into(), json),
        Shape::U8 | Shape::Byte => number(u8::read(reader)?.into(), json),
        Shape::U16 => number(u16::read(reader)?.into(), json),
        Shape::U32 => number(u32::read(reader)?.into(), json),
        Shape::U64 => number(u64::read(reader)?.into(), json),
        Shape::F32 => {
            let value = f32::read(reader)?;
            float(format!("{value:?}"), value.into(), json);
        }
        Shape::F64 => {
            let value = f64::read(reader)?;
            float(format!("{value:?}"), value, json);
        }
        Shape::Text => text(reader.text()?, json),
        Shape::Option(of) => match reader.is_present()? {
            true => write(*of, reader, json)?,
            false => json.push_str("null"),
        },
        Shape::List(of) => {
            let length = reader.length()?;
            list(*of, length, reader, json)?;
        }
        Shape::Array(of, length) => list(*of, length, reader, json)?,
        Shape::Struct(of) => object(of.fields, reader, json)?,
        Shape::Enum(of) => variant(of, reader, json)?,
    }
    Ok(())
}

fn list(of: Shape, length: usize, reader: &mut Reader<'_>, json: &mut String) -> Result<(), DecodeError> {
    json.push('[');
    for index in 0..length {
        if index > 0 {
            json.push(',');
        }
        write(of, reader, json)?;
    }
    json.push(']');
    Ok(())
}

fn object(fields: &'static [FieldShape], reader: &mut Reader<'_>, json: &mut String) -> Result<(), DecodeError> {
    match Form::of(fields) {
        Form::Transparent(shape) => return write(shape, reader, json),
        Form::Empty => {
            reader.nothing()?;
            json.push_str("{}");
        }
        Form::Object(fields) => {
            for (index, field) in fields.iter().enumerate() {
                json.push(if index > 0 { ',' } else { '{' });
                text(field.name, json);
                json.push(':');
                write(field.shape, reader, json)?;
            }
            json.push('}');
        }
    }
    Ok(())
}

fn variant(of: &'static EnumShape, reader: &mut Reader<'_>, json: &mut String) -> Result<(), DecodeError> {
    let shape = Shape::Enum(of);
    let number = reader.variant(&shape)?;
    let Some(variant) = of.variants.get(number as usize) else { return Err(reader.no_variant(number)) };
    if variant.fields.is_empty() {
        text(variant.name, json);
    } else {
        json.push('{');
        text(variant.name, json);
        json.push(':');
        object(variant.fields, reader, json)?;
        json.push('}');
    }
    reader.end_variant(&shape, number)
}

fn number(value: i128, json: &mut String) {
    // Writing to a string cannot fail.
    let _ = write!(json, "{value}");
}

fn float(shortest: String, value: f64, json: &mut String) {
    match value {
        _ if value.is_finite() => json.push_str(&shortest),
        _ if value.is_nan() => text(NAN, json),
        _ if value > 0.0 => text(INFINITY, json),
        _ => text(NEGATIVE_INFINITY, json),
    }
}

pub(super) fn text(text: &str, json: &mut String) {
    json.push('"');
    for letter in text.chars() {
        match letter {
            '"' => json.push_str("\\\""),
            '\\' => json.push_str("\\\\"),
            '\n' => json.push_str("\\n"),
            control if control < ' ' => {
                let _ = write!(json, "\\u{:04x}", u32::from(control));
            }
            other => json.push(other),
        }
    }
    json.push('"');
}
