//! Speed at which messages of an IMU are recorded and read, and the size that they take.

use bb_core::nalgebra::{Matrix3, Vector3};
use bb_core::payload::Imu;
use bb_core::pubsub::{AnyTopic, Topic};
use bb_core::time::MonotonicTime;
use bb_core::{DynamicSubscription, Overflow, Select, Stamped, WallTime};
use bb_mcap::{Compression, Recorder, RecorderOptions, Recording, RecordingError};
use std::time::{Duration, Instant};

const COUNT: i64 = 200_000;

fn main() -> Result<(), RecordingError> {
    for (is_plain, compression) in
        [(true, Compression::None), (true, Compression::Lz4), (true, Compression::Zstd), (false, Compression::Lz4)]
    {
        let file = std::env::temp_dir().join(format!("bb-mcap-speed-{}.mcap", std::process::id()));
        let topic = Topic::<Imu>::new("sensor/base/imu");
        let all = [&topic as &dyn AnyTopic];
        let all = DynamicSubscription::new(all, Select::All, None, Overflow::DropOldest { capacity: 1000 });
        let mut options = RecorderOptions::default();
        options.compression = compression;
        let mut recorder = Recorder::new(&file, all, options)?;
        let mut writing = Duration::ZERO;
        for block in 0..COUNT / 1000 {
            for number in block * 1000..(block + 1) * 1000 {
                let phase = number as f64 * 1e-3;
                let mut imu = Imu::new(Vector3::new(phase.sin(), phase.cos(), 0.1), Vector3::new(0.0, phase, 9.81));
                // A covariance without an orientation is what ROS cannot say.
                imu.orientation_covariance = (!is_plain).then(Matrix3::identity);
                let mut message = Stamped::new(MonotonicTime::from_nanos(number * 1_000_000), imu);
                message.wall_time = WallTime::from_unix_nanos(number * 1_000_000);
                topic.publish(&message);
            }
            let start = Instant::now();
            recorder.drain()?;
            writing += start.elapsed();
        }
        let report = recorder.finish()?;
        let size = std::fs::metadata(&file).map_or(0, |about| about.len());
        let start = Instant::now();
        let recording = Recording::open(&file)?;
        let opening = start.elapsed();
        let start = Instant::now();
        let read = recording.messages::<Imu>("sensor/base/imu")?.filter(Result::is_ok).count();
        let reading = start.elapsed();
        assert_eq!((report.lost, read as i64), (0, COUNT));
        let each = |time: Duration| time.as_secs_f64() * 1e6 / COUNT as f64;
        println!(
            "{compression:?}, exact as ROS: {is_plain}: {:.2} µs to write, {:.2} µs to open, {:.2} µs to read, {} bytes each",
            each(writing),
            each(opening),
            each(reading),
            size / COUNT as u64
        );
        // It is ours.
        let _ = std::fs::remove_file(&file);
    }
    Ok(())
}
