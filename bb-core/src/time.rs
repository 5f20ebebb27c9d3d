//! Time: instants as integers of nanoseconds, the one [`Clock`] that all code reads, and the counters of devices.

mod clock;
mod device;
mod instant;
mod stopwatch;

pub use clock::Clock;
pub use device::DeviceClock;
pub(crate) use instant::nanos_of;
pub use instant::{MonotonicTime, WallTime};
pub(crate) use stopwatch::{Reading, Stopwatch};
