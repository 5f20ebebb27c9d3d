//! Functions that the derive calls for each field of a payload, so that a type that is not a field is reported once.

use super::{DecodeError, Field, Reader, Shape, Writer};
use std::marker::PhantomData;

/// Returns whether a field is finite. Of the functions that the derive calls, only this and [`is_any`] require a [`Field`].
#[inline]
pub fn is_finite<T: Field>(value: &T) -> bool {
    value.is_finite()
}

/// Always true, for a field that may hold NaN and infinities.
pub fn is_any<T: Field>(_: &T) -> bool {
    true
}

/// Calls `T`'s implementation of [`Field`] if it has one, otherwise [`NotField`]: inherent functions take precedence.
#[derive(Debug)]
pub struct FieldOf<T>(PhantomData<fn() -> T>);

impl<T: Field> FieldOf<T> {
    /// The meaning of its bytes.
    pub const SHAPE: Shape = T::SHAPE;

    /// `true` if no value uses the heap.
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

    /// Reads it, as the field of that name.
    ///
    /// # Errors
    /// The field's error, with its name.
    pub fn read(reader: &mut Reader<'_>, name: &'static str) -> Result<T, DecodeError> {
        reader.field(name)
    }
}

/// Fallback for a type that is not a field. It never runs, since such a payload does not compile.
pub trait NotField<T> {
    /// Any shape.
    const SHAPE: Shape = Shape::Bool;

    /// Any value.
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
    fn read(reader: &mut Reader<'_>, _: &'static str) -> Result<T, DecodeError> {
        Err(reader.error("a field", "none"))
    }
}

impl<T> NotField<T> for FieldOf<T> {}
