//! Reads CDR by a definition. Every value has at least one byte, so no definition makes a message longer than its
//! bytes.

use super::{Count, Field, Kind, MessageDefinition, Value};
use bb_core::message::DecodeError;
use bb_core::message::codec::Reader;
use std::sync::Arc;

/// Reads a message. Bytes that follow it are ignored: ROS counts padding for empty lists that it does not write.
pub(super) fn message(definition: &MessageDefinition, data: &[u8]) -> Result<Value, DecodeError> {
    fields(definition, 0, &mut Reader::of_message(data)?)
}

fn fields(definition: &MessageDefinition, index: usize, reader: &mut Reader<'_>) -> Result<Value, DecodeError> {
    let message = &definition.messages[index];
    let fields = message.fields.iter().map(|field| {
        let value = counted(definition, field, reader).map_err(|error| error.within(field.name.to_string()))?;
        Ok((field.name.clone(), value))
    });
    let fields = fields.collect::<Result<Vec<_>, _>>()?;
    if fields.is_empty() {
        // The content of a struct without fields.
        reader.raw(1, "a byte")?;
    }
    Ok(Value::Message(fields))
}

fn counted(definition: &MessageDefinition, field: &Field, reader: &mut Reader<'_>) -> Result<Value, DecodeError> {
    let length = match field.count {
        Count::One => return one(definition, field.kind, reader),
        Count::Exactly(length) if length > reader.left() => {
            return Err(reader.error("as many elements as are declared", format!("{} bytes", reader.left())));
        }
        Count::Exactly(length) => length,
        Count::Any => reader.length()?,
    };
    if field.kind == Kind::U8 {
        return Ok(Value::Bytes(reader.raw(length, "bytes")?.to_vec()));
    }
    // Memory for a length is allocated as the elements arrive.
    let mut values = Vec::new();
    for index in 0..length {
        values.push(one(definition, field.kind, reader).map_err(|error| error.within(format!("[{index}]")))?);
    }
    Ok(Value::List(values))
}

fn one(definition: &MessageDefinition, kind: Kind, reader: &mut Reader<'_>) -> Result<Value, DecodeError> {
    const NUMBER: &str = "a number";
    Ok(match kind {
        Kind::Bool => match reader.number::<1>("a bool")? {
            [0] => Value::Bool(false),
            [1] => Value::Bool(true),
            [other] => return Err(reader.error("0 or 1", other.to_string())),
        },
        Kind::I8 => Value::Signed(i8::from_le_bytes(reader.number(NUMBER)?).into()),
        Kind::I16 => Value::Signed(i16::from_le_bytes(reader.number(NUMBER)?).into()),
        Kind::I32 => Value::Signed(i32::from_le_bytes(reader.number(NUMBER)?).into()),
        Kind::I64 => Value::Signed(i64::from_le_bytes(reader.number(NUMBER)?)),
        Kind::U8 => Value::Unsigned(u8::from_le_bytes(reader.number(NUMBER)?).into()),
        Kind::U16 => Value::Unsigned(u16::from_le_bytes(reader.number(NUMBER)?).into()),
        Kind::Variant(index) => {
            let number = u32::from_le_bytes(reader.number(NUMBER)?);
            let variants = &definition.messages[index].variants;
            match variants.iter().find(|(known, _)| *known == number) {
                Some((_, name)) => Value::Variant { number, name: Arc::clone(name) },
                None => Value::Unsigned(number.into()),
            }
        }
        Kind::U32 => Value::Unsigned(u32::from_le_bytes(reader.number(NUMBER)?).into()),
        Kind::U64 => Value::Unsigned(u64::from_le_bytes(reader.number(NUMBER)?)),
        Kind::F32 => Value::F32(f32::from_le_bytes(reader.number(NUMBER)?)),
        Kind::F64 => Value::F64(f64::from_le_bytes(reader.number(NUMBER)?)),
        Kind::Text => Value::Text(reader.text()?.to_owned()),
        Kind::Message(index) => fields(definition, index, reader)?,
    })
}
