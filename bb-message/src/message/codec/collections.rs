//! Options, lists and arrays.

use super::{DecodeError, Field, Reader, Shape, Writer};
use std::sync::Arc;

/// Bytes that the values hold on the heap, in addition to their `size_of`.
pub(super) fn heap_bytes_of<'a, T: Field + 'a>(values: impl IntoIterator<Item = &'a T>) -> usize {
    if T::IS_INLINE { 0 } else { values.into_iter().map(T::heap_bytes).sum() }
}

impl<T: Field> Field for Option<T> {
    const SHAPE: Shape = Shape::Option(&T::SHAPE);
    const IS_INLINE: bool = T::IS_INLINE;
    fn heap_bytes(&self) -> usize {
        heap_bytes_of(self)
    }
    fn write(&self, writer: &mut Writer<'_>) {
        writer.length(usize::from(self.is_some()));
        if let Some(value) = self {
            value.write(writer);
        }
    }
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        Ok(if reader.is_present()? { Some(T::read(reader)?) } else { None })
    }
}

impl<T: Field> Field for Vec<T> {
    const SHAPE: Shape = Shape::List(&T::SHAPE);
    fn heap_bytes(&self) -> usize {
        self.capacity() * size_of::<T>() + heap_bytes_of(self)
    }
    fn write(&self, writer: &mut Writer<'_>) {
        writer.length(self.len());
        T::write_all(self, writer);
    }
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        let length = reader.length()?;
        T::read_all(length, reader)
    }
}

/// An array without elements has no counterpart in ROS and is written as a list that is always empty.
impl<T: Field, const N: usize> Field for [T; N] {
    const SHAPE: Shape = if N == 0 { Shape::Option(&T::SHAPE) } else { Shape::Array(&T::SHAPE, N) };
    const IS_INLINE: bool = T::IS_INLINE;
    fn heap_bytes(&self) -> usize {
        heap_bytes_of(self)
    }
    fn write(&self, writer: &mut Writer<'_>) {
        if N == 0 {
            writer.length(0);
        }
        T::write_all(self, writer);
    }
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        if N == 0 {
            reader.absent(1)?;
        }
        let values = T::read_all(N, reader)?;
        values.try_into().map_err(|values: Vec<T>| reader.error("all elements", values.len().to_string()))
    }
}

impl<T: Field> Field for Arc<T> {
    const SHAPE: Shape = T::SHAPE;
    fn heap_bytes(&self) -> usize {
        size_of::<T>() + T::heap_bytes(self)
    }
    fn write(&self, writer: &mut Writer<'_>) {
        T::write(self, writer);
    }
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        T::read(reader).map(Self::new)
    }
}

impl<T: Field> Field for Arc<[T]> {
    const SHAPE: Shape = Shape::List(&T::SHAPE);
    fn heap_bytes(&self) -> usize {
        size_of_val::<[T]>(self) + heap_bytes_of(self.iter())
    }
    fn write(&self, writer: &mut Writer<'_>) {
        writer.length(self.len());
        T::write_all(self, writer);
    }
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        Vec::read(reader).map(Self::from)
    }
}
