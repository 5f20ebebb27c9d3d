//! The frame of a record.

/// The longest record or decompressed chunk that is accepted, in bytes. Recorders make chunks of about a megabyte; a
/// much larger length is damage, and trusting it would fill the memory.
pub(crate) const LIMIT: u64 = 256 << 20;

/// Every record starts with its kind (one byte) and its length (eight bytes, little endian).
pub(crate) const FRAME: usize = 1 + 8;

/// Splits the frame of a record into kind and length.
pub(crate) fn unframe(frame: [u8; FRAME]) -> (u8, u64) {
    let [opcode, length @ ..] = frame;
    (opcode, u64::from_le_bytes(length))
}
