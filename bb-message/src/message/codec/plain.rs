//! Numbers, text and times.

use super::intern::{MAX_NAME_BYTES, intern};
use super::{DecodeError, Field, FieldShape, Reader, Shape, StructShape, Writer};
use crate::time::{MonotonicTime, WallTime};
use std::time::Duration;

macro_rules! numbers {
    ($($kind:ty, $shape:ident, $expected:literal;)*) => { $(
        impl Field for $kind {
            const IS_INLINE: bool = true;
            const SHAPE: Shape = Shape::$shape;
            fn write(&self, writer: &mut Writer<'_>) {
                writer.number(self.to_le_bytes());
            }
            fn write_all(values: &[Self], writer: &mut Writer<'_>) {
                writer.numbers(values, Self::to_le_bytes);
            }
            fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
                reader.number($expected).map(Self::from_le_bytes)
            }
        }
    )* };
}

numbers! {
    i8, I8, "an integer of one byte";
    i16, I16, "an integer of two bytes";
    i32, I32, "an integer of four bytes";
    i64, I64, "an integer of eight bytes";
    u16, U16, "an integer of two bytes";
    u32, U32, "an integer of four bytes";
    u64, U64, "an integer of eight bytes";
    f32, F32, "a number of four bytes";
    f64, F64, "a number of eight bytes";
}

impl Field for u8 {
    const IS_INLINE: bool = true;
    const SHAPE: Shape = Shape::U8;
    fn write(&self, writer: &mut Writer<'_>) {
        writer.raw(&[*self]);
    }
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        reader.number::<1>("a byte").map(|[byte]| byte)
    }
    fn write_all(values: &[Self], writer: &mut Writer<'_>) {
        writer.raw(values);
    }
    fn read_all(length: usize, reader: &mut Reader<'_>) -> Result<Vec<Self>, DecodeError> {
        reader.raw(length, "bytes").map(<[u8]>::to_vec)
    }
}

/// Numbers written as another type that can represent all of them.
macro_rules! as_other {
    ($($kind:ty, $other:ty, $expected:literal;)*) => { $(
        impl Field for $kind {
            const IS_INLINE: bool = true;
            const SHAPE: Shape = <$other>::SHAPE;
            fn write(&self, writer: &mut Writer<'_>) {
                (*self as $other).write(writer);
            }
            fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
                let number = <$other>::read(reader)?;
                number.try_into().map_err(|_| reader.error($expected, number.to_string()))
            }
        }
    )* };
}

as_other! {
    usize, u64, "an integer that this machine can address";
    isize, i64, "an integer that this machine can address";
}

/// ROS has no integers of 16 bytes: two of eight, the lower one first.
macro_rules! wide {
    ($($kind:ty),*) => { $(
        impl Field for $kind {
            const IS_INLINE: bool = true;
            const SHAPE: Shape = Shape::Array(&Shape::U64, 2);
            fn write(&self, writer: &mut Writer<'_>) {
                (*self as u64).write(writer);
                ((*self >> 64) as u64).write(writer);
            }
            fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
                let (low, high) = (u64::read(reader)?, u64::read(reader)?);
                Ok((u128::from(high) << 64 | u128::from(low)) as $kind)
            }
        }
    )* };
}

wide!(u128, i128);

impl Field for bool {
    const IS_INLINE: bool = true;
    const SHAPE: Shape = Shape::Bool;
    fn write(&self, writer: &mut Writer<'_>) {
        writer.raw(&[u8::from(*self)]);
    }
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        match u8::read(reader)? {
            0 => Ok(false),
            1 => Ok(true),
            other => Err(reader.error("0 or 1", other.to_string())),
        }
    }
}

impl Field for char {
    const IS_INLINE: bool = true;
    const SHAPE: Shape = Shape::Char;
    fn write(&self, writer: &mut Writer<'_>) {
        u32::from(*self).write(writer);
    }
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        let value = u32::read(reader)?;
        char::from_u32(value).ok_or_else(|| reader.error("a character", format!("{value:#x}")))
    }
}

impl Field for () {
    const IS_INLINE: bool = true;
    const SHAPE: Shape = Shape::Struct(&StructShape { name: "Nothing", fields: &[FieldShape::NOTHING] });
    fn write(&self, writer: &mut Writer<'_>) {
        writer.nothing();
    }
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        reader.nothing()
    }
}

impl Field for String {
    const SHAPE: Shape = Shape::Text;
    fn write(&self, writer: &mut Writer<'_>) {
        writer.text(self);
    }
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        reader.text().map(str::to_owned)
    }
    fn heap_bytes(&self) -> usize {
        self.capacity()
    }
}

/// Each distinct text that is read stays in memory. When their total size reaches [`MAX_NAME_BYTES`], no further one
/// is read.
impl Field for &'static str {
    const IS_INLINE: bool = true;
    const SHAPE: Shape = Shape::Text;
    fn write(&self, writer: &mut Writer<'_>) {
        writer.text(self);
    }
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        let text = reader.text()?;
        intern(text).ok_or_else(|| {
            let found = format!("one more, beyond the {MAX_NAME_BYTES} bytes that all names may have together");
            reader.error("a name", found)
        })
    }
}

impl Field for Duration {
    const IS_INLINE: bool = true;
    const SHAPE: Shape = Shape::Struct(&StructShape {
        name: "Duration",
        fields: &[FieldShape::new("sec", Shape::U64), FieldShape::new("nanosec", Shape::U32)],
    });
    fn write(&self, writer: &mut Writer<'_>) {
        self.as_secs().write(writer);
        self.subsec_nanos().write(writer);
    }
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        let (seconds, nanos): (u64, u32) = (reader.field("sec")?, reader.field("nanosec")?);
        if nanos >= 1_000_000_000 {
            return Err(reader.error("less than 1e9 nanoseconds", nanos.to_string()).within("nanosec"));
        }
        Ok(Self::new(seconds, nanos))
    }
}

impl Field for MonotonicTime {
    const IS_INLINE: bool = true;
    const SHAPE: Shape = Shape::I64;
    fn write(&self, writer: &mut Writer<'_>) {
        self.as_nanos().write(writer);
    }
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        i64::read(reader).map(Self::from_nanos)
    }
}

impl Field for WallTime {
    const IS_INLINE: bool = true;
    const SHAPE: Shape = Shape::I64;
    fn write(&self, writer: &mut Writer<'_>) {
        self.as_unix_nanos().write(writer);
    }
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        i64::read(reader).map(Self::from_unix_nanos)
    }
}
