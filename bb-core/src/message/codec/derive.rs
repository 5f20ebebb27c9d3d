//! How the derive names the fields of a payload: so that a type that is not a field is reported in one place.

use super::{DecodeError, Field, Reader, Shape, Writer};
use std::marker::PhantomData;

/// Whether a field is finite. Of all that the derive generates, this and [`is_any`] alone require a [`Field`].
pub fn is_finite<T: Field>(value: &T) -> bool {
    value.is_finite()
}

/// Always true, for a field that may hold NaN and infinities.
pub fn is_any<T: Field>(_: &T) -> bool {
    true
}

/// What `T` does as a field, if it is one; else what [`NotField`] does, since own functions go first.
#[derive(Debug)]
pub struct FieldOf<T>(PhantomData<fn() -> T>);

impl<T: Field> FieldOf<T> {
    /// What its bytes mean.
    pub const SHAPE: Shape = T::SHAPE;

    /// Whether no value holds anything on the heap.
    pub const IS_INLINE: bool = T::IS_INLINE;

    /// Bytes that it holds on the heap.
    #[inline]
    pub fn heap_bytes(value: &T) -> usize {
        if T::IS_INLINE { 0 } else { value.heap_bytes() }
    }

    /// Appends it.
    #[inline]
    pub fn write(value: &T, writer: &mut Writer<'_>) {
        value.write(writer);
    }

    /// Reads the field `name`.
    ///
    /// # Errors
    /// What is wrong with it, by its name.
    #[inline]
    pub fn read(reader: &mut Reader<'_>, name: &'static str) -> Result<T, DecodeError> {
        reader.field(name)
    }
}

/// What holds of a type that is no field: nothing that is ever run, since it does not compile.
pub trait NotField<T> {
    /// Any.
    const SHAPE: Shape = Shape::Bool;

    /// Any.
    const IS_INLINE: bool = true;

    /// None.
    fn heap_bytes(_: &T) -> usize {
        0
    }

    /// Does nothing.
    fn write(_: &T, _: &mut Writer<'_>) {}

    /// Fails.
    ///
    /// # Errors
    /// Always.
    fn read(reader: &mut Reader<'_>, name: &'static str) -> Result<T, DecodeError> {
        Err(reader.error("a field", "none").within(name))
    }
}

impl<T> NotField<T> for FieldOf<T> {}
