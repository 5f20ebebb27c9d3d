//! A checksum of a message, to compare an output with that of the recorded run.

use crate::message::codec::Writer;
use crate::message::{Payload, Stamped};
use std::cell::RefCell;

thread_local! {
    /// Buffer kept to reuse its allocation.
    static BYTES: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
}

/// Returns a checksum of the payload's bytes, the times and the frame. Not cryptographic: it detects an algorithm that is not
/// deterministic.
pub(crate) fn checksum<T: Payload>(message: &Stamped<T>) -> u64 {
    BYTES.with(|bytes| {
        // A payload's own `write` may publish; it then gets another buffer.
        let mut own = Vec::new();
        let mut kept = bytes.try_borrow_mut();
        let bytes = match &mut kept {
            Ok(kept) => &mut **kept,
            Err(_) => &mut own,
        };
        bytes.clear();
        message.payload.write(&mut Writer::new(bytes));
        let mut sum = mix(message.monotonic_time.as_nanos() as u64, message.wall_time.as_unix_nanos() as u64);
        sum = mix(sum, message.frame.name().len() as u64);
        let (words, rest) = bytes.as_chunks::<8>();
        for word in words {
            sum = mix(sum, u64::from_le_bytes(*word));
        }
        let mut last = [0; 8];
        last[..rest.len()].copy_from_slice(rest);
        mix(mix(sum, u64::from_le_bytes(last)), bytes.len() as u64)
    })
}

/// One round of folded multiplication, as in wyhash.
fn mix(sum: u64, word: u64) -> u64 {
    let product = u128::from(sum ^ 0x9e37_79b9_7f4a_7c15) * u128::from(word ^ 0xe703_7ed1_a0b4_28db);
    (product as u64) ^ ((product >> 64) as u64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::Payload;
    use crate::time::MonotonicTime;

    #[derive(Clone, Debug, Payload)]
    struct Number(f64);

    #[test]
    fn every_bit_counts() {
        let message = |value: f64, nanos| Stamped::new(MonotonicTime::from_nanos(nanos), Number(value));
        let first = checksum(&message(1.5, 7));
        assert_eq!(first, checksum(&message(1.5, 7)));
        assert_ne!(first, checksum(&message(1.5, 8)));
        for bit in 0..64 {
            assert_ne!(first, checksum(&message(f64::from_bits(1.5_f64.to_bits() ^ (1 << bit)), 7)), "bit {bit}");
        }
    }
}
