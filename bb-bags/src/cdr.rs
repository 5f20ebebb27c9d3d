//! One payload: four bytes that name the encoding, then plain CDR.

use byteorder::{BigEndian, ByteOrder, LittleEndian};
use cdr_encoding::{CdrDeserializer, Error};
use serde::de::DeserializeOwned;

/// The length of the encapsulation header. Alignment counts from its end.
const HEADER: usize = 4;

/// Writers may pad a payload to a multiple of four bytes. More than that left over means that the payload is of
/// another type.
const PADDING: usize = 3;

/// Reads a payload as a `T`; the error says in words what is wrong and where in the payload.
pub(crate) fn decode<T: DeserializeOwned>(payload: &[u8]) -> Result<T, String> {
    let Some((header, body)) = payload.split_at_checked(HEADER) else {
        return Err(format!("the payload has {} bytes, too few for the header of CDR", payload.len()));
    };
    // The first two bytes are the representation, always big endian; the other two are options that plain CDR
    // leaves unused.
    match u16::from_be_bytes([header[0], header[1]]) {
        0x0000 => body_of::<T, BigEndian>(body),
        0x0001 => body_of::<T, LittleEndian>(body),
        other => Err(format!(
            "the payload has representation {other:#06x}{}, and only plain CDR (0x0000, 0x0001) is read",
            match other {
                0x0002 | 0x0003 => " (parameter list)",
                0x0006..=0x000b => " (XCDR2)",
                _ => "",
            }
        )),
    }
}

fn body_of<T: DeserializeOwned, O: ByteOrder>(body: &[u8]) -> Result<T, String> {
    let mut reader = CdrDeserializer::<O>::new(body);
    let value = T::deserialize(&mut reader);
    let at = reader.bytes_consumed();
    let length = HEADER + body.len();
    match value {
        Ok(value) if body.len() - at <= PADDING => Ok(value),
        Ok(_) => Err(format!(
            "{} bytes are left over after the last field, at byte {} of the payload",
            body.len() - at,
            HEADER + at
        )),
        Err(Error::Eof) => {
            Err(format!("the payload ends too early: a field at byte {} of {length} does not fit", HEADER + at))
        }
        Err(Error::BadBoolean(byte)) => {
            Err(format!("byte {} of the payload should be a bool, 0 or 1, and is {byte}", HEADER + at - 1))
        }
        Err(Error::BadUTF8(_)) => Err(format!("the text before byte {} of the payload is not UTF-8", HEADER + at)),
        Err(other) => Err(format!("at byte {} of the payload: {other}", HEADER + at)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros::*;
    use serde::Serialize;

    fn encode<T: Serialize, O: ByteOrder>(header: [u8; 4], value: &T) -> Vec<u8> {
        let mut bytes = header.to_vec();
        bytes.extend(cdr_encoding::to_vec::<T, O>(value).expect("encodes"));
        bytes
    }

    fn little<T: Serialize>(value: &T) -> Vec<u8> {
        encode::<T, LittleEndian>([0, 1, 0, 0], value)
    }

    fn header() -> Header {
        Header { stamp: Stamp { sec: 7, nanosec: 8 }, frame_id: "imu".into() }
    }

    /// Written out from the definition of CDR, not by the encoder that the other tests use.
    #[test]
    fn a_payload_by_hand() {
        let mut bytes = vec![0, 1, 0, 0];
        bytes.extend(7i32.to_le_bytes());
        bytes.extend(8u32.to_le_bytes());
        bytes.extend(4u32.to_le_bytes());
        bytes.extend(b"imu\0");
        for v in [1.0, 2.0, 3.0] {
            bytes.extend(f64::to_le_bytes(v));
        }
        for v in 0..9 {
            bytes.extend(f64::from(v).to_le_bytes());
        }
        let got: MagneticField = decode(&bytes).expect("reads");
        assert_eq!(got.header, header());
        assert_eq!(got.magnetic_field, Vector3 { x: 1.0, y: 2.0, z: 3.0 });
        assert_eq!(got.magnetic_field_covariance, [0., 1., 2., 3., 4., 5., 6., 7., 8.]);
    }

    /// `float64[36]` has no length prefix; neither may the nested array that stands for it.
    #[test]
    fn nested_covariances_have_the_bytes_of_flat_ones() {
        let mut pose = PoseWithCovariance::default();
        for (i, v) in pose.covariance.iter_mut().flatten().enumerate() {
            *v = i as f64;
        }
        let bytes = little(&pose);
        assert_eq!(bytes.len(), 4 + 8 * (7 + 36));
        for i in 0..36 {
            let at = 4 + 8 * (7 + i);
            assert_eq!(bytes[at..at + 8], (i as f64).to_le_bytes());
        }
    }

    #[test]
    fn both_byte_orders_and_up_to_three_bytes_of_padding() {
        let sent = JointState {
            header: header(),
            name: vec!["a".into(), "bc".into()],
            position: vec![1.0, 2.0],
            velocity: vec![],
            effort: vec![f64::MAX],
        };
        for mut bytes in [little(&sent), encode::<_, BigEndian>([0, 0, 0, 0], &sent)] {
            for _ in 0..=3 {
                assert_eq!(decode::<JointState>(&bytes), Ok(sent.clone()));
                bytes.push(0);
            }
            let fault = decode::<JointState>(&bytes).unwrap_err();
            assert!(fault.starts_with("4 bytes are left over"), "{fault}");
        }
    }

    #[test]
    fn other_representations_are_named() {
        let fault = decode::<Bool>(&[0, 7, 0, 0, 1]).unwrap_err();
        assert!(fault.contains("0x0007 (XCDR2)"), "{fault}");
        let fault = decode::<Bool>(&[0, 3, 0, 0, 1]).unwrap_err();
        assert!(fault.contains("0x0003 (parameter list)"), "{fault}");
        let fault = decode::<Bool>(&[0, 1, 0]).unwrap_err();
        assert!(fault.contains("3 bytes"), "{fault}");
    }

    #[test]
    fn a_bool_is_zero_or_one() {
        assert_eq!(decode::<Bool>(&[0, 1, 0, 0, 1]), Ok(Bool { data: true }));
        assert_eq!(decode::<Bool>(&[0, 1, 0, 0, 0]), Ok(Bool { data: false }));
        let fault = decode::<Bool>(&[0, 1, 0, 0, 2]).unwrap_err();
        assert_eq!(fault, "byte 4 of the payload should be a bool, 0 or 1, and is 2");
    }

    #[test]
    fn text_that_is_not_utf8() {
        let mut bytes = little(&header());
        bytes[16] = 0xff;
        let fault = decode::<Header>(&bytes).unwrap_err();
        assert!(fault.contains("not UTF-8"), "{fault}");
    }

    #[test]
    fn a_payload_cut_anywhere_is_an_error() {
        let bytes = little(&Imu { header: header(), ..Imu::default() });
        for end in 0..bytes.len() {
            assert!(decode::<Imu>(&bytes[..end]).is_err(), "{end}");
        }
        assert!(decode::<Imu>(&bytes).is_ok());
    }

    /// A length prefix is believed only as far as there are bytes, so this neither allocates nor takes long.
    #[test]
    fn a_huge_length_prefix_is_an_error() {
        let sent = JointState { header: header(), ..JointState::default() };
        let good = little(&sent);
        for at in [12, 20, 24, 28, 32] {
            let mut bytes = good.clone();
            bytes[at..at + 4].fill(0xff);
            let fault = decode::<JointState>(&bytes).unwrap_err();
            assert!(fault.contains("ends too early"), "{at}: {fault}");
        }
    }
}
