//! MCAP files: recordings of a robot's runs, and ROS 2 bags of any program.
//!
//! | what | where |
//! |---|---|
//! | write what a robot publishes | [`Recorder`] |
//! | read it back, bit for bit | [`Recording`] |
//! | read ROS messages from any bag, including those of a [`Recorder`] | [`Bag`] |
//! | play back what was recorded in the place of a sensor or an estimator | [`PlayedSensor`], [`PlayedEstimator`] |
//! | play back any topic of a bag as the sensor of a robot | [`BagSensor`] |
//! | play back a recorded IMU with its magnetometer, or read its samples | [`BagImu`], [`MargSamples`] |
//! | read messages of any type, by the definition in the file | [`MessageDefinition`], [`Value`] |
//! | write payloads as ROS messages | [`BagWriter`] |
//! | messages of ROS 1 as those of ROS 2 | [`Ros1Definition`] |
//! | the true orientation in a bag | [`Truth`] |
//! | save the part of a damaged file before the break | [`recover`] |
//!
//! A recording is a ROS 2 bag. Payloads that correspond to a ROS message are written as that message, all others with their
//! own definition. The robot's frames, URDF and name are included, so that viewers show the run
//! without further set-up. What the ROS message cannot represent is written beside it, so that a [`Recording`]
//! returns the `Stamped<T>` that was published.
//!
//! ```no_run
//! use bb_core::prelude::*;
//! use bb_estimators::SimulatedImu;
//! use bb_mcap::{Recorder, RecorderOptions, Recording};
//!
//! robot! {
//!     robot Rover;
//!     link base { sensor imu: SimulatedImu() { rate: 200 Hz; } }
//! }
//!
//! fn main() -> Result<(), Box<dyn std::error::Error>> {
//!     let builder = Rover::builder();
//!     let all = builder.subscribe_any(Select::All, None, Overflow::DropOldest { capacity: 10_000 });
//!     let recorder = Recorder::new("walk.mcap", all, RecorderOptions::of::<Rover>())?.spawn()?;
//!     let running = builder.start()?;
//!     std::thread::sleep(Duration::from_secs(1));
//!     running.stop();
//!     let report = recorder.stop()?;
//!     println!("{} messages, {} lost", report.messages, report.lost);
//!
//!     for message in Recording::open("walk.mcap")?.messages::<Marg>("sensor/base/imu")? {
//!         let message = message?;
//!         println!("{}: {}", message.monotonic_time, message.imu.angular_velocity);
//!     }
//!     Ok(())
//! }
//! ```
//!
//! # What is lost when the process dies
//!
//! Everything that was flushed is kept. At most the last [`flush_messages`](RecorderOptions::flush_messages) messages
//! or those of the last [`flush_interval`](RecorderOptions::flush_interval), whichever is less, are lost, and those
//! still queued in the subscription. Such a file is truncated; [`Recording::open`] reads it up to the cut, and
//! [`recover`] makes a complete file of that part. When the machine loses power, data not yet written by the
//! operating system is lost too, unless [`sync`](RecorderOptions::sync) is set.
//!
//! # Memory and trust
//!
//! Files are streamed: one chunk is in memory, compressed and decompressed, and records or chunks above 256 MiB are refused.
//! Lengths are compared with the file before anything is allocated for them. If the recorder wrote a checksum for a chunk, it is
//! checked before the first message is delivered, except for a chunk that breaks off. Messages outside chunks
//! have no checksum, so a changed bit in their payload is not detected unless it breaks the encoding. Every
//! error names the file, the position in it and what to do; no input makes this crate panic.
//!
//! # A slow disk
//!
//! Nothing waits for the disk. The subscription is the queue; when it is full, the oldest message is lost and counted, and the
//! count is written at the end of the file.

// A robot must not stop because of an unexpected value.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod bag;
mod clock;
mod definition;
mod error;
mod file;
mod layout;
mod played;
mod recorder;
mod recording;
mod recover;
mod writer;

pub use bag::{
    Bag, BagImu, BagImuOptions, BagMessage, BagMessages, BagSensor, BagSensorOptions, Bool, IMU, MAGNETIC_FIELD,
    MOVING, MargSamples, ODOMETRY, POSE, Topic, Truth,
};
pub use definition::{MessageDefinition, Ros1Definition, Value};
pub use error::{RecordingError, RecordingErrorKind};
pub use played::{PlayedEstimator, PlayedOptions, PlayedSensor};
pub use recorder::{BackgroundRecorder, Compression, Recorder, RecorderOptions, RecorderReport};
pub use recording::{AllMessages, Messages, RecordedChannel, RecordedMessage, Recording};
pub use recover::{Recovered, recover};
pub use writer::BagWriter;
