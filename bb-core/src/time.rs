//! Time: the instants of messages, the one [`Clock`] that all code reads, and the counters of devices.

mod clock;
mod device;
mod stopwatch;

pub(crate) use bb_message::__private::nanos_of;
pub use bb_message::instant::{MonotonicTime, WallTime};
pub use clock::Clock;
pub use device::DeviceClock;
pub(crate) use stopwatch::{Reading, Stopwatch};
