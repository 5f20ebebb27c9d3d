//! Round trip: messages are read as they were published.

use super::robot::{Gripper, Rover, Temporary, record, rover};
use bb_core::message::codec::encode;
use bb_core::prelude::*;
use bb_core::pubsub::{AnyTopic, Topic};
use bb_core::{DynamicSubscription, Finite as _, Frame, Origin};
use bb_mcap::{Compression, Recorder, RecorderOptions, Recording, RecordingErrorKind, recover};

fn bytes_of<T: Payload>(messages: impl IntoIterator<Item = Stamped<T>>) -> Vec<Vec<u8>> {
    let bytes = |message: Stamped<T>| {
        let mut bytes = Vec::new();
        encode(&message, &mut bytes);
        bytes
    };
    messages.into_iter().map(bytes).collect()
}

fn read<T: Payload>(recording: &Recording, path: &str) -> Vec<Vec<u8>> {
    let messages = recording.messages::<T>(path).expect("it was recorded");
    bytes_of(messages.map(|message| message.expect("the file is whole")))
}

#[test]
fn a_simulated_run_is_read_back_bit_for_bit() {
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        let file = Temporary::new(&format!("{compression:?}"));
        let builder = Rover::builder();
        let imu = builder.subscribe(rover::sensor::base::imu);
        let compass = builder.subscribe(rover::sensor::base::compass);
        let locator = builder.subscribe(rover::sensor::base::locator);
        let grip = builder.subscribe(rover::sensor::base::arm::hand::grip);
        let encoder = builder.subscribe(rover::sensor::base::arm::encoder);
        let all = builder.subscribe_any(Select::All, None, Overflow::default());
        let mut options = RecorderOptions::of::<Rover>();
        options.compression = compression;
        options.flush_messages = 7;
        let mut recorder = Recorder::new(&file, all, options).expect("it can be created");
        let mut simulation = builder.simulate().expect("it starts");
        let mut drained = 0;
        for _ in 0..20 {
            simulation.run_for(Duration::from_millis(50));
            drained += recorder.drain().expect("there is room");
        }
        let report = recorder.finish().expect("there is room");
        assert_eq!((report.messages, report.flushed, report.lost), (drained, drained, 0));

        let recording = Recording::open(&file).expect("it was recorded");
        assert_eq!((recording.robot(), recording.lost()), (Some("Rover"), Some(0)));
        assert!(recording.broken().is_none());
        assert_eq!(recording.urdf(), Some(Rover::to_urdf().as_str()));
        assert_eq!(read::<Imu>(&recording, "sensor/base/imu"), bytes_of(imu.drain()));
        assert_eq!(read::<MagneticField>(&recording, "sensor/base/compass"), bytes_of(compass.drain()));
        assert_eq!(read::<Odometry>(&recording, "sensor/base/locator"), bytes_of(locator.drain()));
        assert_eq!(read::<Gripper>(&recording, "sensor/base/arm/hand/grip"), bytes_of(grip.drain()));
        assert_eq!(read::<JointState>(&recording, "sensor/base/arm/encoder"), bytes_of(encoder.drain()));

        let all: Vec<_> =
            recording.all().expect("it is there").map(|message| message.expect("it is whole")).collect();
        assert_eq!(all.len() as u64, drained);
        let counted: u64 = recording.channels().iter().map(|channel| channel.messages).sum();
        assert_eq!(counted, drained);
        for message in all.iter().filter(|message| message.channel.payload == "Gripper") {
            assert_eq!(message.decode::<Gripper>().map(|read| read.wall_time).ok(), Some(message.time));
        }
    }
}

#[test]
fn a_real_run_is_recorded_beside_it() {
    let file = Temporary::new("real");
    let builder = Rover::builder();
    let imu = builder.subscribe(rover::sensor::base::imu);
    let all = builder.subscribe_any(Select::Below("sensor/base"), None, Overflow::default());
    let recorder = Recorder::new(&file, all, RecorderOptions::of::<Rover>()).expect("it can be created");
    let recorder = recorder.spawn().expect("a thread starts");
    let running = builder.start().expect("it starts");
    while recorder.report().messages < 50 {
        std::thread::sleep(Duration::from_millis(5));
    }
    running.stop();
    assert!(recorder.is_running());
    let report = recorder.stop().expect("there is room");
    assert_eq!(report.messages, report.flushed);
    let recording = Recording::open(&file).expect("it was recorded");
    assert_eq!(read::<Imu>(&recording, "sensor/base/imu"), bytes_of(imu.drain()));
}

#[test]
fn stamps_that_do_not_follow_from_ros_are_read_back_too() {
    // Times that 32 bits of seconds do not hold, and times of another clock than that of the first message.
    let file = Temporary::new("stamps");
    let topic = Topic::<MagneticField>::new("far/field");
    let other = Topic::<Gripper>::new("far/grip");
    let all = DynamicSubscription::new([&topic as &dyn AnyTopic, &other], Select::All, None, Overflow::default());
    let stamps = [(0, 0), (5, 7), (9, 11), (-3, -4), (i64::MIN, i64::MAX), (i64::MAX, i64::MIN), (1, 1)];
    let mut sent = Vec::new();
    for (number, (monotonic, wall)) in stamps.into_iter().enumerate() {
        let message = Stamped {
            payload: MagneticField::new(bb_core::nalgebra::Vector3::repeat(number as f64)),
            monotonic_time: MonotonicTime::from_nanos(monotonic),
            wall_time: WallTime::from_unix_nanos(wall),
            frame: Frame::new(["base", "mast"][number % 2]),
            origin: Origin { robot: "Rover", node: ["near", "far"][number / 4] },
        };
        topic.publish(&message);
        sent.push(message);
        other.publish(&message.stamp().message(Gripper::Open));
    }
    Recorder::new(&file, all, RecorderOptions::default()).and_then(Recorder::finish).expect("there is room");
    let recording = Recording::open(&file).expect("it was recorded");
    assert_eq!(read::<MagneticField>(&recording, "far/field"), bytes_of(sent.clone()));
    let grips = sent.iter().map(|message| message.stamp().message(Gripper::Open));
    assert_eq!(read::<Gripper>(&recording, "far/grip"), bytes_of(grips));
}

#[test]
fn asking_for_what_is_not_there_says_what_is() {
    let file = Temporary::new("ask");
    record(&file, 100);
    let recording = Recording::open(&file).expect("it was recorded");
    let no_path = recording.messages::<Imu>("sensor/imu").expect_err("it is elsewhere").to_string();
    assert!(no_path.contains("nothing was recorded at `sensor/imu`; there are `sensor/base/imu`"), "{no_path}");
    let other = recording.messages::<Pose>("sensor/base/imu").expect_err("it is an IMU").to_string();
    assert!(other.contains("`sensor/base/imu` was recorded as `Imu`, and `Pose` is now"), "{other}");
    {
        /// Payload of the same name with other fields.
        #[derive(Clone, Debug, Payload)]
        enum Gripper {
            Open,
        }
        let _ = Gripper::Open.is_finite();
        let changed = recording.messages::<Gripper>("sensor/base/arm/hand/grip").expect_err("it has changed");
        assert!(changed.to_string().contains("recorded as `Gripper` with other fields"), "{changed}");
    }
}

#[test]
fn files_that_cannot_be_written_or_are_something_else_are_named() {
    let file = Temporary::new("exists");
    record(&file, 50);
    let new = |path: &std::path::Path| {
        let all = Rover::builder().subscribe_any(Select::All, None, Overflow::KeepLatest);
        Recorder::new(path, all, RecorderOptions::default()).map(drop)
    };
    let exists = new(&file).expect_err("it is there");
    assert!(matches!(exists.kind(), RecordingErrorKind::Exists));
    assert!(exists.to_string().starts_with(&file.display().to_string()), "{exists}");
    let nowhere = file.with_extension("").join("no").join("such.mcap");
    let error = new(&nowhere).expect_err("there is no such folder");
    assert!(matches!(error.kind(), RecordingErrorKind::Create(_)), "{error}");
    assert!(error.to_string().contains("such.mcap: cannot be created"), "{error}");

    let text = Temporary::new("text");
    std::fs::write(&text, "time,x,y").expect("there is room");
    assert!(matches!(Recording::open(&text).expect_err("it is text").kind(), RecordingErrorKind::NotMcap { .. }));
    let missing = Recording::open(&nowhere).expect_err("it is not there");
    assert!(matches!(missing.kind(), RecordingErrorKind::Missing), "{missing}");
    assert!(recover(&file, &text).expect_err("nothing is overwritten").to_string().contains("exists already"));
}

#[test]
fn what_a_slow_recorder_misses_is_counted_in_the_file() {
    let file = Temporary::new("slow");
    let builder = Rover::builder();
    let all = builder.subscribe_any(Select::Path("sensor/base/imu"), None, Overflow::DropOldest { capacity: 10 });
    let recorder = Recorder::new(&file, all, RecorderOptions::default()).expect("it can be created");
    let mut simulation = builder.simulate().expect("it starts");
    simulation.run_until(MonotonicTime::from_nanos(495_000_000));
    let report = recorder.finish().expect("there is room");
    assert_eq!((report.messages, report.lost), (10, 90));
    assert_eq!(Recording::open(&file).expect("it was recorded").lost(), Some(90));
}
