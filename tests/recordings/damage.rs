//! Files that break off anywhere, and files with wrong bytes.

use super::robot::{Temporary, record_some};
use bb_core::prelude::*;
use bb_mcap::{Compression, RecorderOptions, Recording, recover};
use std::fs::{File, OpenOptions};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::Path;

/// Returns the number of messages that can be read; that nothing panics is the point.
fn readable(path: &Path) -> usize {
    let Ok(recording) = Recording::open(path) else { return 0 };
    let imu = recording.messages::<Imu>("sensor/base/imu");
    imu.map_or(0, |messages| messages.filter(Result::is_ok).count())
}

/// A file small enough to be broken at every byte.
fn small(path: &Path, millis: u64, compression: Compression) -> Vec<u8> {
    let mut options = RecorderOptions::default();
    options.compression = compression;
    options.flush_messages = 2;
    record_some(path, millis, Select::Path("sensor/base/imu"), options);
    std::fs::read(path).expect("it was recorded")
}

#[test]
fn a_file_that_breaks_off_anywhere_is_read_up_to_there_and_repaired() {
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        let whole = Temporary::new(&format!("whole-{compression:?}"));
        let bytes = small(&whole, 30, compression);
        let count = readable(&whole);
        let (cut, repaired) = (Temporary::new(&format!("cut-{compression:?}")), Temporary::new("repaired"));
        std::fs::copy(&whole, &cut).expect("there is room");
        let file = OpenOptions::new().write(true).open(&cut).expect("it was copied");
        let mut last = count;
        for length in (0..bytes.len()).rev() {
            file.set_len(length as u64).expect("it becomes shorter");
            let now = readable(&cut);
            assert!(now <= last, "{now} of {length} bytes, {last} of one more");
            let is_summary = length + 1 == bytes.len();
            assert!(!is_summary || now == count, "all messages stand before the summary");
            last = now;
            // Repairing is slow, and the same code reads: a few lengths will do.
            if length % 97 != 0 {
                continue;
            }
            let _ = std::fs::remove_file(&repaired);
            let Ok(recovered) = recover(&cut, &repaired) else {
                assert!(length < 8, "{length}");
                continue;
            };
            assert!(recovered.broken.is_some_and(|broken| broken.is_break()));
            if now > 0 {
                let recording = Recording::open(&repaired).expect("it was repaired");
                assert!(recording.broken().is_none(), "{:?}", recording.broken());
                assert_eq!(readable(&repaired), now);
            }
        }
        assert_eq!(last, 0);
    }
}

/// Replaces one byte.
fn put(mut file: &File, at: usize, byte: u8) -> io::Result<()> {
    file.seek(SeekFrom::Start(at as u64))?;
    file.write_all(&[byte])
}

#[test]
fn wrong_bytes_never_panic() {
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        let whole = Temporary::new(&format!("good-{compression:?}"));
        let bytes = small(&whole, 10, compression);
        let (wrong, repaired) = (Temporary::new(&format!("wrong-{compression:?}")), Temporary::new("of-wrong"));
        std::fs::copy(&whole, &wrong).expect("there is room");
        let file = OpenOptions::new().write(true).open(&wrong).expect("it was copied");
        for (at, good) in bytes.iter().enumerate() {
            for value in [0xff, good ^ 1] {
                put(&file, at, value).expect("it is there");
                readable(&wrong);
                if at % 7 == 0 {
                    let _ = std::fs::remove_file(&repaired);
                    let _ = recover(&wrong, &repaired);
                }
            }
            put(&file, at, *good).expect("it is there");
        }
    }
}
