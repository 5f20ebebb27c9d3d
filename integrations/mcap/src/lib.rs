//! MCAP files: recordings of a robot's runs, and ROS 2 bags of any program.
//!
//! | what | where |
//! |---|---|
//! | write what a robot publishes | [`Recorder`] |
//! | read it back, bit for bit | [`Recording`] |
//! | read the messages of ROS in any bag, those of a [`Recorder`] too | [`Bag`] |
//! | play a recorded IMU as the sensor of a robot, or take its samples | [`BagImu`], [`MargSamples`] |
//! | read messages of any type, by the definition in the file | [`MessageDefinition`], [`Value`] |
//! | write payloads as the messages of ROS | [`BagWriter`] |
//! | what a bag knows of the true orientation | [`Truth`] |
//! | make a whole file of what is before a break | [`recover`] |
//!
//! A recording is a ROS 2 bag: payloads that ROS has a message for are written as that message, all others with a
//! definition of their own; the robot's frames, its URDF and its name are there as well, so that viewers show the run
//! with no further set-up. What ROS's message cannot hold of a message is written beside it, and what a [`Recording`]
//! gives is the `Stamped<T>` that was published.
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
//! What was flushed stays: at most the last [`flush_messages`](RecorderOptions::flush_messages) messages or those of the
//! last [`flush_interval`](RecorderOptions::flush_interval), whichever is less, and what still waits in the subscription.
//! Such a file has no end; [`Recording::open`] reads it up to the break, and [`recover`] makes a whole one of it. When the
//! machine loses power, what the operating system had not yet written is lost too, unless
//! [`sync`](RecorderOptions::sync) is set.
//!
//! # Memory and trust
//!
//! Files are streamed: memory holds one chunk, packed and unpacked, and no record or chunk above 256 MiB is taken. Lengths
//! are compared with the file before anything is allocated for them. A chunk's checksum is compared before its first
//! message is delivered, where the recorder wrote one; of a chunk that breaks off it cannot be. Messages outside chunks
//! carry no checksum of their own, so there a changed bit in a payload goes unseen unless it breaks the encoding. Every
//! error names the file, the place in it and the way out; no input makes this crate panic.
//!
//! # A slow disk
//!
//! Nothing waits for it: the subscription is the queue, and when it is full the oldest message is lost, counted, and the
//! count is written at the end of the file.

// A robot must not stop because a value was not what it was taken for.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod bag;
mod clock;
mod definition;
mod error;
mod file;
mod layout;
mod recorder;
mod recording;
mod recover;
mod writer;

pub use bag::{
    Bag, BagImu, BagImuOptions, BagMessage, BagMessages, Bool, IMU, MAGNETIC_FIELD, MOVING, MargSamples, ODOMETRY,
    POSE, Topic, Truth,
};
pub use definition::{MessageDefinition, Value};
pub use error::{RecordingError, RecordingErrorKind};
pub use recorder::{BackgroundRecorder, Compression, Recorder, RecorderOptions, RecorderReport};
pub use recording::{AllMessages, Messages, RecordedChannel, RecordedMessage, Recording};
pub use recover::{Recovered, recover};
pub use writer::BagWriter;
