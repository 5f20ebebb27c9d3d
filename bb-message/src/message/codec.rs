//! Payloads as bytes, bit for bit, in a layout that other programs read.
//!
//! | what | where |
//! |---|---|
//! | what a field of a payload implements | [`Field`]; `#[derive(Payload)]` implements it for structs and enums |
//! | plain CDR, little endian, as ROS 2 writes it | [`Writer`], [`Reader`] |
//! | the layout of the bytes | [`Shape`], and as text for other programs [`Schema`] (`ros2msg`) |
//! | the hashes by which ROS 2 tells types and services apart | [`type_hash`], [`service_hash`] |
//! | a message in the layout that ROS has for it | [`RosMessage`] |
//! | all of these for one payload, without its type | [`Layouts`] |
//! | a value to JSON and back, and the JSON Schema of a type | [`to_json`], [`from_json`], [`json_schema`] |
//!
//! A message has an *exact* layout, that of [`Stamped`](super::Stamped) with all its fields. It may also have the
//! layout of a ROS message, which viewers understand, but which cannot represent every value.
//!
//! Reading accepts bytes from anywhere: it never panics, allocates no more than the available bytes justify, and
//! names the field that is wrong.
//!
//! Why not an existing crate for CDR? They use serde, which knows the values of a type but not its shape, so
//! definitions for other programs would be written a second time and could differ. Every payload and all its fields
//! would have to implement serde's traits. And none gives the guarantees of the previous paragraph.

mod algebra;
mod collections;
mod definitions;
pub(crate) mod derive;
mod error;
pub(crate) mod intern;
pub(crate) mod json;
mod plain;
mod reader;
pub mod ros;
mod schema;
mod sha256;
mod shape;
mod stamped;
#[cfg(test)]
mod tests;
mod type_description;
mod writer;

pub use error::DecodeError;
pub use intern::MAX_NAME_BYTES;
pub use json::{JsonError, bytes_to_json, from_json, json_schema, json_to_bytes, to_json};
pub use reader::Reader;
pub use ros::{RosCompanion, RosLayout, RosMessage};
pub use schema::Schema;
pub use shape::{EnumShape, FieldRange, FieldShape, FieldUnit, Shape, StructShape};
pub use stamped::{Layouts, decode_as_ros, decode_companion, encode_as_ros, encode_companion, is_exact_as_ros};
pub use type_description::{service_hash, type_description, type_hash};
pub use writer::Writer;

use super::Finite;

/// Data that can be written as bytes and read back unchanged, bit for bit, NaN included.
///
/// Numbers, `bool`, `char`, text, `Option`, `Vec`, arrays, `Arc`, times and nalgebra's fixed and dynamic matrices,
/// quaternions and isometries are fields. `#[derive(Payload)]` makes structs and enums of fields into fields. A type
/// that contains itself cannot be one, since its shape would be infinite.
#[diagnostic::on_unimplemented(
    message = "`{Self}` cannot be written to a recording and read back",
    label = "cannot be a field of a payload",
    note = "derive it: `#[derive(Clone, Debug, Payload)]`, or make it of numbers, text, `Option`, `Vec`, arrays and \
            nalgebra's types"
)]
pub trait Field: Finite + Sized {
    /// Shape of the value: the meaning of its bytes.
    const SHAPE: Shape;

    /// `true` if no value uses the heap, so that [`heap_bytes`](Self::heap_bytes) need not be called.
    const IS_INLINE: bool = false;

    /// Bytes that it holds on the heap, in addition to its `size_of`. Data shared by an `Arc` counts in full.
    /// Subscriptions are bounded by it, see `Overflow`. The derive adds up the fields; a type with
    /// its own implementation should report it too.
    fn heap_bytes(&self) -> usize {
        0
    }

    /// Appends it.
    fn write(&self, writer: &mut Writer<'_>);

    /// Reads what [`write`](Self::write) has written.
    ///
    /// # Errors
    /// The field that is wrong, and what was expected there.
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError>;

    /// Appends all of `values`.
    #[doc(hidden)]
    fn write_all(values: &[Self], writer: &mut Writer<'_>) {
        for value in values {
            value.write(writer);
        }
    }

    /// Reads `length` values.
    #[doc(hidden)]
    fn read_all(length: usize, reader: &mut Reader<'_>) -> Result<Vec<Self>, DecodeError> {
        // A length from outside reserves only as much as the remaining bytes can hold.
        let mut values = Vec::with_capacity(length.min(reader.left() / size_of::<Self>().max(1)));
        for index in 0..length {
            match Self::read(reader) {
                Ok(value) => values.push(value),
                Err(error) => return Err(error.at_index(index)),
            }
        }
        Ok(values)
    }
}

/// Appends `value` as CDR, with the four bytes before it that name the encoding.
pub fn encode<T: Field>(value: &T, bytes: &mut Vec<u8>) {
    value.write(&mut Writer::of_message(bytes));
}

/// Reads a value that [`encode`] has written.
///
/// # Errors
/// The field that is wrong, and what was expected there.
pub fn decode<T: Field>(bytes: &[u8]) -> Result<T, DecodeError> {
    let mut reader = Reader::of_message(bytes)?;
    let value = T::read(&mut reader)?;
    match reader.end_message() {
        Ok(()) => Ok(value),
        Err(error) => Err(error),
    }
}
