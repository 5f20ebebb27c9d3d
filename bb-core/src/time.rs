//! Time: instants as integers of nanoseconds, and the one [`Clock`] that everything reads.

mod clock;
mod instant;

pub use clock::Clock;
pub use instant::{MonotonicTime, WallTime};
