//! Time: the instants of messages, the one [`Clock`] that all code reads, and the counters of devices.

mod clock;
mod device;
pub(crate) mod instant;
pub(crate) mod stopwatch;

pub use clock::Clock;
pub use device::DeviceClock;
pub use instant::{MonotonicTime, WallTime};
