//! ROS 2 bags in MCAP, read message by message.
//!
//! [`Bag::open`] learns which topics a recording has; [`Bag::messages`] then reads the chosen ones lazily, in
//! the order of the file. Every error names the file, the place in it and the way out; no input makes this
//! crate panic.
//!
//! ```no_run
//! use bb_bags::{Bag, RosMessage};
//!
//! fn main() -> Result<(), bb_bags::BagError> {
//!     let bag = Bag::open("walk.mcap")?;
//!     let imu = bag.topic_of("sensor_msgs/msg/Imu")?;
//!     for message in bag.messages(&[&imu.name])? {
//!         let message = message?;
//!         if let RosMessage::Imu(imu) = message.payload {
//!             println!("{} ns: {:?} rad/s", imu.header.stamp.nanoseconds(), imu.angular_velocity);
//!         }
//!     }
//!     Ok(())
//! }
//! ```
//!
//! [`BagImu`] plays a recorded IMU as the sensor of a robot, [`MargSamples`] gives its samples without one, and
//! [`Truth`] is what a recording knows of the true orientation.
//!
//! # What is read
//!
//! Files with the messages in chunks (uncompressed, lz4 or zstd) or outside them, with a summary or without one,
//! and of a recorder that was killed: everything before the break comes first, then the error. Payloads are
//! plain CDR in either byte order; [`RosMessage`] lists the types.
//!
//! # Memory and trust
//!
//! The file is streamed: memory holds one chunk, packed and unpacked, whatever the size of the bag. A chunk's
//! checksum is compared before its first message is delivered, where the recorder wrote one. Messages outside
//! chunks carry no checksum of their own, so there a changed bit in a payload goes unseen unless it breaks the
//! encoding.

mod bag;
mod cdr;
mod channels;
mod error;
mod imu;
mod messages;
mod records;
pub mod ros;
mod samples;
mod summary;
mod truth;

pub use bag::{Bag, Topic};
pub use error::{BagError, BagErrorKind};
pub use imu::{BagImu, BagImuOptions, IMU, MAGNETIC_FIELD};
pub use messages::{Message, Messages};
pub use ros::RosMessage;
pub use samples::MargSamples;
pub use truth::{MOVING, ODOMETRY, POSE, Truth};
