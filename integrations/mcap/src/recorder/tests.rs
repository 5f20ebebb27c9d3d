//! A disk that is full.

use super::*;
use bb_core::payload::JointState;
use bb_core::pubsub::{AnyTopic, Topic};
use bb_core::{Overflow, Select, Stamped, time::MonotonicTime};
use std::io::{Cursor, SeekFrom};
use std::sync::{Arc, Mutex};

/// Takes so many bytes.
struct Disk {
    written: Arc<Mutex<Cursor<Vec<u8>>>>,
    room: usize,
}

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut written = self.written.lock().map_err(|_| io::ErrorKind::Other)?;
        match self.room.saturating_sub(written.get_ref().len()) {
            0 => Err(io::ErrorKind::StorageFull.into()),
            room => written.write(&bytes[..bytes.len().min(room)]),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Disk {
    fn seek(&mut self, position: SeekFrom) -> io::Result<u64> {
        self.written.lock().map_err(|_| io::ErrorKind::Other)?.seek(position)
    }
}

fn publish(topic: &Topic<JointState>, count: u32) {
    for number in 0..count {
        let state = JointState { position: number.into(), velocity: None, effort: None };
        topic.publish(&Stamped::new(MonotonicTime::from_nanos(number.into()), state));
    }
}

#[test]
fn a_full_disk_is_an_error_that_names_the_file_and_what_was_written_before_is_readable() {
    let topic = Topic::<JointState>::new("sensor/arm/encoder");
    let all = DynamicSubscription::new([&topic as &dyn AnyTopic], Select::All, None, Overflow::default());
    let written = Arc::new(Mutex::new(Cursor::new(Vec::new())));
    let disk = Disk { written: Arc::clone(&written), room: 4000 };
    let options = RecorderOptions { flush_messages: 10, ..RecorderOptions::default() };
    let mut recorder = Recorder::on(Path::new("full.mcap"), Box::new(disk), None, all, options).expect("it fits");
    publish(&topic, 1000);
    let error = recorder.drain().expect_err("it does not fit");
    let flushed = recorder.report().flushed;
    let expected =
        format!("full.mcap: cannot be written to, only the first {flushed} messages are certain to be in it: ");
    assert!(error.to_string().starts_with(&expected), "{error}");
    assert!(flushed > 0 && recorder.report().messages < 1000);
    publish(&topic, 1);
    let again = recorder.drain().expect_err("it was given up");
    assert!(matches!(again.kind(), RecordingErrorKind::GivenUp));
    assert!(matches!(recorder.finish().expect_err("it was given up").kind(), RecordingErrorKind::GivenUp));

    let file = std::env::temp_dir().join(format!("bb-mcap-full-{}.mcap", std::process::id()));
    std::fs::write(&file, written.lock().expect("nobody panicked").get_ref()).expect("there is room here");
    let recording = crate::Recording::open(&file).expect("it breaks off");
    let read = recording.messages::<JointState>("sensor/arm/encoder").expect("it was recorded");
    assert!(read.filter(Result::is_ok).count() as u64 >= flushed);
    std::fs::remove_file(&file).expect("it is ours");
}

#[test]
fn a_disk_that_is_full_at_the_end_of_the_file_is_reported() {
    let topic = Topic::<JointState>::new("sensor/arm/encoder");
    let mut failed_at_the_end = 0;
    // However much fits: the header, a part of the chunk, all but the last byte.
    for room in 0.. {
        let all = DynamicSubscription::new([&topic as &dyn AnyTopic], Select::All, None, Overflow::default());
        let written = Arc::new(Mutex::new(Cursor::new(Vec::new())));
        let disk = Disk { written: Arc::clone(&written), room };
        let options = RecorderOptions { flush_messages: 2, ..RecorderOptions::default() };
        let Ok(mut recorder) = Recorder::on(Path::new("full.mcap"), Box::new(disk), None, all, options) else {
            continue;
        };
        publish(&topic, 3);
        let Ok(_) = recorder.drain() else { continue };
        let flushed = recorder.report().flushed;
        match recorder.finish() {
            Ok(report) => {
                assert_eq!((report.messages, report.flushed), (3, 3));
                break;
            }
            Err(error) => {
                failed_at_the_end += 1;
                assert!(
                    matches!(error.kind(), RecordingErrorKind::Write { messages, .. } if *messages == flushed),
                    "{error}"
                );
            }
        }
    }
    assert!(failed_at_the_end > 10);
}

#[cfg(unix)]
#[test]
fn a_file_that_another_program_removes_or_truncates_is_reported() {
    type Change = fn(&Path) -> io::Result<()>;
    let remove: Change = |path| std::fs::remove_file(path);
    let truncate: Change = |path| File::create(path).map(drop);
    for (change, wording) in [(remove, "removed"), (truncate, "truncated")] {
        // At a flush, and at the end.
        for flushes in [true, false] {
            let topic = Topic::<JointState>::new("sensor/arm/encoder");
            let all = DynamicSubscription::new([&topic as &dyn AnyTopic], Select::All, None, Overflow::default());
            let path =
                std::env::temp_dir().join(format!("bb-mcap-{wording}-{flushes}-{}.mcap", std::process::id()));
            let interval = Duration::from_secs(3600);
            let options = RecorderOptions { flush_interval: interval, ..RecorderOptions::default() };
            let mut recorder = Recorder::new(&path, all, options).expect("there is room");
            publish(&topic, 10);
            recorder.drain().and_then(|_| recorder.flush()).expect("it is there");
            change(&path).expect("it is there");
            publish(&topic, 2);
            recorder.drain().expect("it is not flushed yet");
            let error = if flushes { recorder.flush().err() } else { recorder.finish().err() };
            let error = error.expect("the file is not what was written").to_string();
            assert!(
                error.contains(&format!("was {wording} by another program, and none of the 12 messages")),
                "{error}"
            );
            let _ = std::fs::remove_file(&path);
        }
    }
}

#[test]
fn a_recorder_on_a_thread_says_when_it_has_failed() {
    let topic = Topic::<JointState>::new("sensor/arm/encoder");
    let all = DynamicSubscription::new([&topic as &dyn AnyTopic], Select::All, None, Overflow::default());
    let disk = Disk { written: Arc::default(), room: 1000 };
    let recorder = Recorder::on(Path::new("full.mcap"), Box::new(disk), None, all, RecorderOptions::default());
    let recorder = recorder.and_then(Recorder::spawn).expect("it starts");
    publish(&topic, 1000);
    while recorder.is_running() {
        std::thread::sleep(Duration::from_millis(1));
    }
    let error = recorder.stop().expect_err("it does not fit");
    assert!(matches!(error.kind(), RecordingErrorKind::Write { .. }), "{error}");
}

/// A queue that the samples fill is not where the faults wait.
#[test]
fn what_is_rare_has_a_queue_of_its_own() {
    let often = Topic::<JointState>::new("sensor/arm/encoder");
    let rare = Topic::<JointState>::new("health");
    let of = |topic: &Topic<JointState>, capacity| {
        let overflow = Overflow::DropOldest { capacity };
        DynamicSubscription::new([topic as &dyn AnyTopic], Select::All, None, overflow)
    };
    let file = std::env::temp_dir().join(format!("bb-mcap-also-{}.mcap", std::process::id()));
    let recorder = Recorder::new(&file, of(&often, 10), RecorderOptions::default()).expect("starts");
    let mut recorder = recorder.also(of(&rare, 10)).expect("its names are free");
    publish(&rare, 3);
    publish(&often, 1000);
    assert_eq!(recorder.drain().expect("there is room"), 13);
    let report = recorder.finish().expect("there is room");
    assert_eq!((report.messages, report.lost), (13, 990));
    let recording = crate::Recording::open(&file).expect("is whole");
    assert_eq!(recording.messages::<JointState>("health").expect("was recorded").count(), 3);
    std::fs::remove_file(&file).expect("it is ours");
}
