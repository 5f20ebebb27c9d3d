//! Files that break off anywhere, and files with wrong bytes.

use crate::robot::{Temporary, record};
use bb_core::prelude::*;
use bb_recorder::{Compression, Recording, recover};
use std::path::Path;

/// How many messages can be read, of all and of those of the IMU; that nothing panics is the point.
fn readable(path: &Path) -> usize {
    let Ok(recording) = Recording::open(path) else { return 0 };
    let imu = recording.messages::<Imu>("sensor/base/imu");
    let imu = imu.map_or(0, |messages| messages.filter(Result::is_ok).count());
    let all = recording.all().map_or(0, |messages| messages.filter(Result::is_ok).count());
    assert!(imu <= all);
    all
}

#[test]
fn a_file_that_breaks_off_anywhere_is_read_up_to_there_and_repaired() {
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        let whole = Temporary::new(&format!("whole-{compression:?}"));
        record(&whole, 50, |options| {
            options.compression = compression;
            options.flush_messages = 4;
        });
        let bytes = std::fs::read(&whole).expect("it was recorded");
        let count = readable(&whole);
        let (cut, repaired) = (Temporary::new(&format!("cut-{compression:?}")), Temporary::new("repaired"));
        let mut last = 0;
        for length in 0..bytes.len() {
            std::fs::write(&cut, &bytes[..length]).expect("there is room");
            let now = readable(&cut);
            assert!(now >= last, "{now} of {length} bytes, {last} of one less");
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
        assert_eq!(last, count, "all messages stand before the summary");
    }
}

#[test]
fn wrong_bytes_never_panic() {
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        let whole = Temporary::new(&format!("good-{compression:?}"));
        record(&whole, 20, |options| options.compression = compression);
        let bytes = std::fs::read(&whole).expect("it was recorded");
        let (wrong, repaired) = (Temporary::new(&format!("wrong-{compression:?}")), Temporary::new("of-wrong"));
        for at in (0..bytes.len()).step_by(if compression == Compression::None { 7 } else { 3 }) {
            for value in [0, 0xff, bytes[at] ^ 1] {
                let mut bytes = bytes.clone();
                bytes[at] = value;
                std::fs::write(&wrong, &bytes).expect("there is room");
                readable(&wrong);
                let _ = std::fs::remove_file(&repaired);
                let _ = recover(&wrong, &repaired);
            }
        }
    }
}
