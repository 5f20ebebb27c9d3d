//! Messages compressed one by one, as written by `ros2 bag record --compression-mode message`.

use super::LIMIT;
use std::borrow::Cow;
use std::io::Read;

/// The first bytes of a zstd frame. CDR never starts like this: it starts with a zero.
const ZSTD: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];
/// The first bytes of an lz4 frame.
const LZ4: [u8; 4] = [0x04, 0x22, 0x4d, 0x18];

/// The payload of a message, decompressed if it is compressed individually. The error says what is wrong with it.
pub(crate) fn unpack(payload: &[u8]) -> Result<Cow<'_, [u8]>, String> {
    let unpacked = match payload.first_chunk::<4>() {
        Some(&ZSTD) => zstd::stream::read::Decoder::new(payload).and_then(read),
        Some(&LZ4) => lz4::Decoder::new(payload).and_then(|mut decoder| {
            let unpacked = read(&mut decoder)?;
            // Unlike zstd's, this decoder takes the end of its input for the end of the frame, and reports that only
            // here.
            if unpacked.len() as u64 <= LIMIT { decoder.finish().1.map(|()| unpacked) } else { Ok(unpacked) }
        }),
        _ => return Ok(Cow::Borrowed(payload)),
    };
    let unpacked = unpacked.map_err(|cause| format!("the message cannot be unpacked ({cause})"))?;
    match unpacked.len() as u64 > LIMIT {
        true => Err(format!("the message has more than {LIMIT} bytes unpacked, and at most that many are taken")),
        false => Ok(Cow::Owned(unpacked)),
    }
}

/// One byte more than the limit, to detect longer data.
fn read(decoder: impl Read) -> std::io::Result<Vec<u8>> {
    let mut unpacked = Vec::new();
    decoder.take(LIMIT + 1).read_to_end(&mut unpacked)?;
    Ok(unpacked)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    const TEXT: &[u8] = b"\0\x01\0\0 as it was";

    fn packed_by_lz4(data: &[u8]) -> Vec<u8> {
        let mut encoder = lz4::EncoderBuilder::new().build(Vec::new()).expect("starts");
        encoder.write_all(data).expect("packs");
        let (packed, end) = encoder.finish();
        end.expect("ends");
        packed
    }

    #[test]
    fn packed_messages_are_unpacked() {
        let zstd = zstd::stream::encode_all(TEXT, 0).expect("packs");
        for packed in [zstd, packed_by_lz4(TEXT)] {
            assert_eq!(unpack(&packed).expect("unpacks"), TEXT);
            for end in 4..packed.len() {
                assert!(unpack(&packed[..end]).is_err(), "{end}");
            }
        }
        assert!(matches!(unpack(TEXT), Ok(Cow::Borrowed(TEXT))));
    }

    /// A few kilobytes that claim to be gigabytes.
    #[test]
    fn a_bomb_is_refused_before_it_fills_the_memory() {
        let mut bomb = Vec::new();
        let mut encoder = zstd::stream::write::Encoder::new(&mut bomb, 0).expect("starts");
        let zeros = vec![0; 1 << 20];
        for _ in 0..300 {
            encoder.write_all(&zeros).expect("packs");
        }
        encoder.finish().expect("ends");
        assert!(bomb.len() < 1 << 20);
        assert!(unpack(&bomb).expect_err("too large").contains("more than 268435456 bytes"));
    }
}
