//! Reads plain CDR. Lengths are checked against the remaining bytes before anything is allocated.

use super::{DecodeError, Field, Shape, StructShape};

/// Encoding identifiers: plain CDR.
const BIG_ENDIAN: u16 = 0x0000;
const LITTLE_ENDIAN: u16 = 0x0001;

/// Writers may pad to a multiple of four bytes. If more is left over, it is another type.
const PADDING: usize = 3;

/// Reads values from bytes.
#[derive(Clone, Debug)]
pub struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    /// `true` if numbers begin with the most significant byte.
    is_big_endian: bool,
}

impl<'a> Reader<'a> {
    /// Reads `bytes`, which begin after the encoding header, in little endian.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, is_big_endian: false }
    }

    /// Reads a message, which begins with the four-byte encoding header: plain CDR, in either byte order.
    ///
    /// # Errors
    /// The header is missing, or names another encoding.
    pub fn of_message(bytes: &'a [u8]) -> Result<Self, DecodeError> {
        let Some((header, data)) = bytes.split_first_chunk::<4>() else {
            let found = format!("{} bytes", bytes.len());
            return Err(DecodeError::new(0, "the four bytes that name the encoding", found));
        };
        // The first two are the encoding, in big endian; plain CDR leaves the others unused.
        let encoding = u16::from_be_bytes([header[0], header[1]]);
        let name = match encoding {
            BIG_ENDIAN | LITTLE_ENDIAN => {
                return Ok(Self { is_big_endian: encoding == BIG_ENDIAN, ..Self::new(data) });
            }
            0x0002 | 0x0003 => " (parameter list)",
            0x0006..=0x000b => " (XCDR2)",
            _ => "",
        };
        Err(DecodeError::new(0, "the encoding 0x0000 or 0x0001, plain CDR", format!("{encoding:#06x}{name}")))
    }

    /// The end of a message: nothing but padding is left.
    ///
    /// # Errors
    /// More is left.
    pub(super) fn end_message(&self) -> Result<(), DecodeError> {
        match self.left() {
            0..=PADDING => Ok(()),
            left => Err(self.error("the end", format!("{left} more bytes"))),
        }
    }

    /// The number of remaining bytes.
    pub fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// The error for an unexpected value at this position.
    pub fn error(&self, expected: &'static str, found: impl Into<std::borrow::Cow<'static, str>>) -> DecodeError {
        DecodeError::new(self.at, expected, found)
    }

    /// A number, aligned to a multiple of its size. Its bytes are returned in little endian.
    ///
    /// # Errors
    /// The bytes end early.
    pub fn number<const SIZE: usize>(&mut self, expected: &'static str) -> Result<[u8; SIZE], DecodeError> {
        let padding = self.at.next_multiple_of(SIZE) - self.at;
        let number = self.bytes.get(self.at + padding..).and_then(|rest| rest.first_chunk::<SIZE>());
        let Some(number) = number else { return Err(self.ends(expected)) };
        self.at += padding + SIZE;
        let mut number = *number;
        if self.is_big_endian {
            number.reverse();
        }
        Ok(number)
    }

    /// Bytes, unchanged.
    ///
    /// # Errors
    /// There are fewer bytes.
    pub fn raw(&mut self, length: usize, expected: &'static str) -> Result<&'a [u8], DecodeError> {
        let Some(raw) = self.bytes[self.at..].get(..length) else { return Err(self.ends(expected)) };
        self.at += length;
        Ok(raw)
    }

    /// The number of values that follow. Every value has at least one byte, so there are at most as many as remaining
    /// bytes.
    ///
    /// # Errors
    /// The bytes end early, or are too few for that number of values.
    pub fn length(&mut self) -> Result<usize, DecodeError> {
        let length = u32::from_le_bytes(self.number("a length")?);
        match usize::try_from(length) {
            Ok(length) if length <= self.left() => Ok(length),
            _ => Err(self.error("a length that fits", format!("{length}, with {} bytes left", self.left()))),
        }
    }

    /// Text.
    ///
    /// # Errors
    /// It does not end where its length says, or is not UTF-8.
    pub fn text(&mut self) -> Result<&'a str, DecodeError> {
        let length = self.length()?;
        let bytes = self.raw(length, "text")?;
        let Some((0, text)) = bytes.split_last() else {
            return Err(self.error("a zero that ends the text", "none"));
        };
        std::str::from_utf8(text).map_err(|_| self.error("text in UTF-8", "other bytes before it"))
    }

    /// The field `name`.
    ///
    /// # Errors
    /// The field's error, with its name.
    pub fn field<T: Field>(&mut self, name: &'static str) -> Result<T, DecodeError> {
        match T::read(self) {
            Ok(value) => Ok(value),
            Err(error) => Err(error.within(name)),
        }
    }

    /// Reads a list of at most one element. Returns whether it has one.
    ///
    /// # Errors
    /// It has more than one.
    pub fn is_present(&mut self) -> Result<bool, DecodeError> {
        match u32::from_le_bytes(self.number("a length of 0 or 1")?) {
            0 => Ok(false),
            1 => Ok(true),
            length => Err(self.error("a length of 0 or 1", length.to_string())),
        }
    }

    /// The placeholder of a struct without fields.
    #[doc(hidden)]
    pub fn nothing(&mut self) -> Result<(), DecodeError> {
        self.raw(1, "a byte").map(drop)
    }

    /// The variant number of an enum of that shape, and what comes before the variant's fields: the empty lists of those
    /// before it, and the length of its own.
    #[doc(hidden)]
    pub fn variant(&mut self, shape: &Shape) -> Result<u32, DecodeError> {
        let number = u32::from_le_bytes(self.number("the number of a variant")?);
        let (before, variant, _) = split(shape, number);
        let Some(variant) = variant else { return Err(self.no_variant(number)) };
        self.absent(with_fields(before))?;
        match variant.fields.is_empty() || self.is_present()? {
            true => Ok(number),
            false => Err(self.error("the fields of the variant", "none")),
        }
    }

    /// Reads the rest after the fields of that variant: the empty lists of those after it.
    #[doc(hidden)]
    pub fn end_variant(&mut self, shape: &Shape, number: u32) -> Result<(), DecodeError> {
        let (_, _, after) = split(shape, number);
        self.absent(with_fields(after))
    }

    /// The error for a number without a variant.
    #[doc(hidden)]
    pub fn no_variant(&self, number: u32) -> DecodeError {
        self.error("the number of a variant", number.to_string())
    }

    /// The empty lists of `count` other variants.
    pub(super) fn absent(&mut self, count: usize) -> Result<(), DecodeError> {
        for _ in 0..count {
            if self.is_present()? {
                return Err(self.error("no fields of another variant", "some"));
            }
        }
        Ok(())
    }

    fn ends(&self, expected: &'static str) -> DecodeError {
        self.error(expected, "the end")
    }
}

/// The variants of an enum before that number, the one with it, and those after it.
fn split(shape: &Shape, number: u32) -> (&[StructShape], Option<&StructShape>, &[StructShape]) {
    let Shape::Enum(shape) = shape else { return (&[], None, &[]) };
    match shape.variants.split_at_checked(number as usize) {
        Some((before, [variant, after @ ..])) => (before, Some(variant), after),
        _ => (shape.variants, None, &[]),
    }
}

/// The variants that have a list.
fn with_fields(variants: &[StructShape]) -> usize {
    variants.iter().filter(|variant| !variant.fields.is_empty()).count()
}
