//! Bags with something wrong: always an error that says where, never a panic.

use std::io::Read;
use std::path::Path;

use super::common::ros::Bool;
use super::common::{Maker, file, imu, layouts, little, walk};
use bb_core::prelude::*;
use bb_mcap::{Bag, BagMessage, IMU, MOVING, RecordingError, RecordingErrorKind};
use mcap::WriteOptions;

/// Checks that a message of a readable type decodes.
fn decoded(message: &BagMessage) -> Result<(), RecordingError> {
    match &*message.schema {
        IMU => message.payload::<Imu>().map(drop),
        MOVING => message.decode::<bb_mcap::Bool>().map(drop),
        _ => Ok(()),
    }
}

/// Reads as much as possible. Returns the number of messages, and the error that ended it.
fn read(path: &Path) -> (usize, Option<RecordingError>) {
    let bag = match Bag::open(path) {
        Ok(bag) => bag,
        Err(error) => return (0, Some(error)),
    };
    let names: Vec<_> = bag.topics().iter().map(|t| t.name.clone()).collect();
    let mut messages = match bag.messages(&names) {
        Ok(messages) => messages,
        Err(error) => return (0, Some(error)),
    };
    let mut count = 0;
    loop {
        match messages.next() {
            Some(Ok(message)) => match decoded(&message) {
                Ok(()) => count += 1,
                Err(error) => return (count, Some(error)),
            },
            Some(Err(error)) => {
                assert!(messages.next().is_none(), "fused");
                assert!(!error.to_string().contains('\n'));
                return (count, Some(error));
            }
            None => return (count, None),
        }
    }
}

fn said(path: &Path) -> String {
    let said = read(path).1.expect("an error").to_string();
    let file = format!("{}: ", path.display());
    said.strip_prefix(&file).unwrap_or_else(|| panic!("names the file: {said}")).to_owned()
}

#[test]
fn what_is_not_a_bag() {
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR"));
    assert_eq!(said(&directory.join("none.mcap")), "no such file; check the path");
    assert!(said(directory).starts_with("not a file; name the .mcap or .db3 file itself"));
    #[cfg(not(feature = "sqlite"))]
    assert!(said(&file("sqlite.db3", b"SQLite format 3\0....")).contains("`ros2 bag convert`"));
    assert!(
        said(&file("text.mcap", b"t,gx,gy,gz\n0,1,2,3\n")).starts_with("not an MCAP file: it is text"),
        "{}",
        said(&file("text.mcap", b"t,gx,gy,gz\n0,1,2,3\n"))
    );
    assert!(said(&file("empty.mcap", b"")).starts_with("truncated after 0 messages (byte 0 of 0)"));
    assert!(said(&file("start.mcap", b"\x89MCA")).starts_with("truncated after 0 messages (byte 0 of 4)"));
    assert!(said(&file("magic.mcap", mcap::MAGIC)).starts_with("truncated after 0 messages (byte 8 of 8)"));
}

#[test]
fn topics_that_cannot_be_read() {
    let mut maker = Maker::new(WriteOptions::new());
    maker.topic_encoded("/imu", "sensor_msgs/Imu", "ros1");
    maker.topic("/scan", "sensor_msgs/msg/LaserScan");
    let bag = Bag::open(file("unreadable.mcap", &maker.finish())).expect("opens");
    let kind = |topic| bag.messages(&[topic]).unwrap_err();
    assert!(matches!(kind("/imu").kind(), RecordingErrorKind::Encoding { .. }));
    assert!(
        kind("/imu").to_string().contains("the messages of /imu are encoded as `ros1`, and only `cdr` is read")
    );
    assert!(
        kind("/gps")
            .to_string()
            .ends_with("no topic /gps; the bag has /imu (sensor_msgs/msg/Imu), /scan (sensor_msgs/msg/LaserScan)")
    );
}

#[test]
fn a_malformed_payload_is_named_by_its_place() {
    let cases: [(&str, Vec<u8>, &str); 4] = [
        ("short", little(&imu(0))[..100].to_vec(), "`orientation_covariance[5]`: expected"),
        ("none", vec![], "found 0 bytes"),
        (
            "xcdr2",
            vec![0, 7, 0, 0, 0, 0],
            "expected the encoding 0x0000 or 0x0001, plain CDR at byte 0, found 0x0007 (XCDR2)",
        ),
        ("text", [&little(&imu(0))[..16], &[0xff], &little(&imu(0))[17..]].concat(), "expected text in UTF-8"),
    ];
    for (name, payload, fault) in cases {
        for (layout, options) in layouts() {
            let mut maker = Maker::new(options);
            let a = maker.topic("/imu", "sensor_msgs/msg/Imu");
            let b = maker.topic("/moving", "std_msgs/msg/Bool");
            for i in 0..20 {
                maker.message(a, &imu(i));
                maker.message(b, &Bool { data: true });
            }
            maker.bytes(a, &payload);
            maker.message(a, &imu(21));
            let path = file(&format!("payload_{name}_{layout}.mcap"), &maker.finish());
            let (count, error) = read(&path);
            assert_eq!(count, 40);
            let said = error.expect("an error").to_string();
            assert!(said.contains("mcap: message 21 on /imu at 12.400 s (byte "), "{said}");
            assert!(said.contains(fault), "{said}");
        }
    }
    let mut maker = Maker::new(WriteOptions::new());
    let topic = maker.topic("/moving", "std_msgs/msg/Bool");
    maker.bytes(topic, &[0, 1, 0, 0, 3]);
    let said = said(&file("payload_bool.mcap", &maker.finish()));
    assert!(said.contains("`data`: expected 0 or 1 at byte 1, found 3"), "{said}");
}

/// Cut anywhere, a bag gives the messages before the cut, then says that it is cut.
#[test]
fn cut_anywhere() {
    for (layout, options) in layouts() {
        let bytes = walk(options, 20);
        let path = file(&format!("cut_{layout}.mcap"), &bytes);
        assert!(matches!(read(&path), (40, None)), "{layout}");
        let mut most = 0;
        for end in (0..bytes.len()).step_by(100).chain(bytes.len() - 20..bytes.len()) {
            std::fs::write(&path, &bytes[..end]).expect("writes");
            let (count, error) = read(&path);
            assert!(count >= most, "{layout} {end}: {count} after {most}");
            most = count;
            let error = error.unwrap_or_else(|| panic!("{layout} {end} is cut"));
            assert!(error.is_break());
            match error.kind() {
                RecordingErrorKind::Truncated { messages, byte, size } => {
                    assert_eq!((*messages, *size), (count as u64, end as u64), "{layout}");
                    assert!(*byte <= end as u64);
                }
                other => panic!("{layout} {end}: {other}"),
            }
        }
        assert_eq!(most, 40, "{layout}");
    }
}

/// A changed bit gives an error or, if nothing checks it, fewer or other messages, but never a panic. Chunks without
/// checksums are the hard case: their contents are trusted.
#[test]
fn bits_flipped_anywhere() {
    let mut cases: Vec<_> = layouts().into_iter().map(|(name, options)| (name.to_owned(), options)).collect();
    for (name, options) in layouts() {
        let options = options.calculate_chunk_crcs(false).calculate_summary_section_crc(false);
        cases.push((format!("{name}_unsummed"), options.clone()));
        let options = options.emit_summary_records(false).emit_summary_offsets(false);
        cases.push((format!("{name}_bare"), options));
    }
    for (name, options) in cases {
        let summed = ["zstd", "lz4", "plain"].contains(&&*name);
        let bytes = walk(options, 4);
        let path = file(&format!("flip_{name}.mcap"), &bytes);
        for at in 0..bytes.len() {
            let mut bytes = bytes.clone();
            bytes[at] ^= 1 << (at % 8);
            std::fs::write(&path, &bytes).expect("writes");
            let (count, error) = read(&path);
            assert!(count <= 8, "{name} {at}");
            // Nothing is lost silently: the checksums cover the messages, and the summary counts them, which reveals
            // a chunk hidden by a changed frame.
            if summed && error.is_none() {
                assert_eq!(count, 8, "{name} {at}");
            }
        }
    }
}

/// All bits of a length prefix set, at every place in the file: nothing is allocated for it.
#[test]
fn huge_lengths_anywhere() {
    for (layout, options) in layouts() {
        let bytes = walk(options.calculate_chunk_crcs(false), 4);
        let path = file(&format!("huge_{layout}.mcap"), &bytes);
        for at in 0..bytes.len() - 8 {
            for width in [4, 8] {
                let mut bytes = bytes.clone();
                bytes[at..at + width].fill(0xff);
                std::fs::write(&path, &bytes).expect("writes");
                assert!(read(&path).0 <= 8, "{layout} {at}");
            }
        }
    }
}

#[test]
fn a_damaged_chunk_is_named_by_its_place() {
    let bytes = walk(layouts()[2].1.clone(), 20);
    // In the middle of a chunk, whose sound messages must not be delivered either.
    let at = bytes.len() / 2;
    let mut damaged = bytes.clone();
    damaged[at] ^= 0xff;
    let (count, error) = read(&file("damaged.mcap", &damaged));
    let error = error.expect("an error");
    match error.kind() {
        RecordingErrorKind::Corrupt { messages, byte, .. } => {
            assert_eq!(*messages, count as u64);
            assert!(count > 0 && (*byte as usize) < at);
        }
        other => panic!("{other}"),
    }
    assert!(error.to_string().contains("the checksum of the chunk is"), "{error}");
}

#[test]
fn a_chunk_packed_in_an_unknown_way() {
    let mut bytes = walk(layouts()[0].1.clone(), 20);
    let at = bytes.windows(4).position(|w| w == b"zstd").expect("a chunk");
    bytes[at..at + 4].copy_from_slice(b"brot");
    let said = said(&file("brot.mcap", &bytes));
    assert!(said.starts_with("the chunk at byte ") && said.contains("packed with `brot`"), "{said}");
}

/// A record that exists and is longer than the memory limit. The file is sparse, so it takes no space.
#[test]
fn a_message_of_300_mib_is_refused() {
    let length: u64 = 300 << 20;
    let mut bytes = mcap::MAGIC.to_vec();
    bytes.push(mcap::records::op::MESSAGE);
    bytes.extend(length.to_le_bytes());
    let path = file("long.mcap", &bytes);
    let long = std::fs::OpenOptions::new().write(true).open(&path).expect("opens");
    long.set_len(bytes.len() as u64 + length).expect("becomes longer");
    let said = said(&path);
    assert!(
        said.starts_with("a record of 314572800 bytes at byte 8, after 0 messages, and at most 268435456"),
        "{said}"
    );
    std::fs::remove_file(&path).expect("it is ours");
}

/// A chunk that claims to be short but decompresses to much more is not decompressed beyond its claim.
#[test]
fn a_chunk_that_unpacks_to_more_than_it_says() {
    let packed = zstd::stream::encode_all(std::io::repeat(0).take(300 << 20), 0).expect("packs");
    for unpacked in [1000, 200 << 20, 300 << 20, u64::MAX] {
        let mut chunk = [0u64, 0, unpacked].map(u64::to_le_bytes).concat();
        chunk.extend([0; 4]);
        chunk.extend(4u32.to_le_bytes());
        chunk.extend(b"zstd");
        chunk.extend((packed.len() as u64).to_le_bytes());
        chunk.extend(&packed);
        let mut bytes = mcap::MAGIC.to_vec();
        bytes.push(mcap::records::op::CHUNK);
        bytes.extend((chunk.len() as u64).to_le_bytes());
        bytes.extend(chunk);
        bytes.extend(mcap::MAGIC);
        let (count, error) = read(&file("bomb.mcap", &bytes));
        assert_eq!(count, 0);
        let error = error.expect("it is damaged");
        let is_too_large = matches!(error.kind(), RecordingErrorKind::TooLarge { .. });
        assert_eq!(is_too_large, unpacked > 256 << 20, "{unpacked}: {error}");
    }
}
