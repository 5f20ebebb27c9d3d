//! Writes plain CDR: every number is aligned to a multiple of its size.

use super::Field;

/// The bytes before the data: plain CDR, little endian.
const HEADER: [u8; 4] = [0, 1, 0, 0];

/// Appends values to bytes.
#[derive(Debug)]
pub struct Writer<'a> {
    bytes: &'a mut Vec<u8>,
    /// The origin of alignment: after the four-byte encoding header.
    start: usize,
}

impl<'a> Writer<'a> {
    /// Appends to `bytes`; alignment is relative to the current end.
    pub fn new(bytes: &'a mut Vec<u8>) -> Self {
        let start = bytes.len();
        Self { bytes, start }
    }

    /// Appends a message to `bytes`: the four bytes that name the encoding, then the data.
    pub(super) fn of_message(bytes: &'a mut Vec<u8>) -> Self {
        bytes.extend_from_slice(&HEADER);
        Self::new(bytes)
    }

    /// Appends a number aligned to a multiple of its size.
    #[inline]
    pub fn number<const SIZE: usize>(&mut self, little_endian: [u8; SIZE]) {
        self.align(SIZE);
        self.bytes.extend_from_slice(&little_endian);
    }

    /// Appends numbers of one size: aligned once, as the others follow.
    pub(super) fn numbers<T: Copy, const SIZE: usize>(
        &mut self,
        values: &[T],
        little_endian: impl Fn(T) -> [u8; SIZE],
    ) {
        if values.is_empty() {
            return;
        }
        self.align(SIZE);
        let at = self.bytes.len();
        self.bytes.resize(at + values.len() * SIZE, 0);
        let room = self.bytes.get_mut(at..).unwrap_or_default();
        for (room, value) in room.as_chunks_mut::<SIZE>().0.iter_mut().zip(values) {
            *room = little_endian(*value);
        }
    }

    #[inline]
    fn align(&mut self, size: usize) {
        let length = self.bytes.len() - self.start;
        let padding = length.next_multiple_of(size) - length;
        if padding > 0 {
            self.bytes.resize(self.bytes.len() + padding, 0);
        }
    }

    /// Appends bytes unchanged.
    pub fn raw(&mut self, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
    }

    /// Appends the number of values that follow. CDR lengths have 32 bits; longer data cannot be read back.
    pub fn length(&mut self, length: usize) {
        self.number(u32::try_from(length).unwrap_or(u32::MAX).to_le_bytes());
    }

    /// Appends text: its length including the terminating zero, then both.
    pub fn text(&mut self, text: &str) {
        self.length(text.len() + 1);
        self.raw(text.as_bytes());
        self.raw(&[0]);
    }

    /// Appends the placeholder of a struct without fields, as ROS does.
    #[doc(hidden)]
    pub fn nothing(&mut self) {
        self.raw(&[0]);
    }

    /// Begins an enum: which variant, and an empty list for each variant with fields before it.
    #[doc(hidden)]
    pub fn variant(&mut self, number: u32, before: usize) {
        self.number(number.to_le_bytes());
        self.absent(before);
    }

    /// Appends `count` empty lists.
    #[doc(hidden)]
    pub fn absent(&mut self, count: usize) {
        for _ in 0..count {
            self.length(0);
        }
    }

    /// Begins the fields of the variant that is present: a list of one.
    #[doc(hidden)]
    pub fn present(&mut self) {
        self.length(1);
    }

    /// Appends a field.
    #[doc(hidden)]
    pub fn field<T: Field>(&mut self, value: &T) {
        value.write(self);
    }
}
