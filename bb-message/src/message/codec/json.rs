//! Payloads as JSON, by their shape: for dashboards, bridges and command lines.
//!
//! | value | JSON |
//! |---|---|
//! | integer | a number, exact, even beyond JavaScript's range |
//! | float | a number that reads back the same, or `"NaN"`, `"Infinity"`, `"-Infinity"` |
//! | `char`, text | a string |
//! | `Option` | `null` or the value |
//! | list, array, matrix | an array; a matrix row by row |
//! | vector of three, quaternion | an object with `x`, `y`, `z` and `w` |
//! | struct | an object; one without fields is `{}`; a tuple struct of one field is that field |
//! | enum | the name of the variant, or an object of that name with the variant's fields |
//!
//! Two things are lost: the bits of a NaN, and `Some(None)` of an `Option<Option<T>>`, which reads back as `None`.

pub mod compose;
mod error;
mod read;
mod schema;
#[cfg(test)]
pub(super) mod tests;
mod token;
mod wording;
mod write;

pub use error::JsonError;
pub use read::{from_json, json_to_bytes};
pub use schema::json_schema;
pub use schema::{Definitions, document, member};
pub use token::{elements_of, member_of, members_of};
pub use write::{bytes_to_json, to_json};

use super::shape::{FieldShape, NOTHING, Shape};
use std::ops::RangeInclusive;

/// The floats that JSON has no number for.
const NAN: &str = "NaN";
const INFINITY: &str = "Infinity";
const NEGATIVE_INFINITY: &str = "-Infinity";

/// Form in which the fields of a struct or a variant are written.
enum Form {
    /// No fields: `{}`.
    Empty,
    /// One field without a name: that field.
    Transparent(Shape),
    /// An object.
    Object(&'static [FieldShape]),
}

impl Form {
    fn of(fields: &'static [FieldShape]) -> Self {
        match fields {
            [] | [FieldShape { name: NOTHING, .. }] => Self::Empty,
            [FieldShape { name: "0", shape, .. }] => Self::Transparent(*shape),
            fields => Self::Object(fields),
        }
    }
}

/// The values of an integer's type.
fn range(shape: Shape) -> Option<RangeInclusive<i128>> {
    let (is_signed, bits) = match shape {
        Shape::I8 => (true, 8),
        Shape::I16 => (true, 16),
        Shape::I32 => (true, 32),
        Shape::I64 => (true, 64),
        Shape::U8 | Shape::Byte => (false, 8),
        Shape::U16 => (false, 16),
        Shape::U32 => (false, 32),
        Shape::U64 => (false, 64),
        _ => return None,
    };
    Some(match is_signed {
        true => -(1 << (bits - 1))..=(1 << (bits - 1)) - 1,
        false => 0..=(1 << bits) - 1,
    })
}
