//! The options of a subscription: what it keeps, and how often it gets something.

use super::bound::{Bound, DEFAULT_BYTES};
use std::time::Duration;

/// Treatment of a subscriber that is slower than its publisher.
///
/// A subscription is bounded in messages and in bytes. The bytes of a message are those its payload holds on the heap
/// ([`Field::heap_bytes`](crate::Field::heap_bytes)), plus the message itself if that is larger than 1 KiB; smaller
/// ones are bounded only by their number. One message is always kept, however large it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overflow {
    /// Keeps this many messages, and at most [`Overflow::DEFAULT_BYTES`]. Beyond that, the oldest is dropped, and the
    /// loss is counted.
    DropOldest {
        /// Number of messages that are kept: at least one, and at most [`Overflow::MAX_CAPACITY`].
        capacity: usize,
    },
    /// Keeps this many messages, and at most this many bytes. Beyond that, the oldest is dropped, and the loss is counted.
    DropOldestWithin {
        /// Number of messages that are kept: at least one, and at most [`Overflow::MAX_CAPACITY`].
        capacity: usize,
        /// Total bytes of the kept messages; `usize::MAX` for no bound.
        bytes: usize,
    },
    /// Keeps only the newest message. The others are counted by `lagged`, not as lost: nobody wanted them.
    KeepLatest,
    /// Keeps the newest message of each path; the others count as with [`Overflow::KeepLatest`]. A newer message takes the place of the one that waits, so
    /// that each path has its turn. It is bounded by the number of paths.
    LatestPerPath,
}

impl Default for Overflow {
    fn default() -> Self {
        Self::DropOldest { capacity: 1024 }
    }
}

impl Overflow {
    /// The largest capacity of a subscription, in messages.
    pub const MAX_CAPACITY: usize = 1 << 20;

    /// Default bound on the total bytes of a subscription's messages: 64 MiB.
    pub const DEFAULT_BYTES: usize = DEFAULT_BYTES;

    /// Adds a highest rate, for a display: of each path at most one message in each `period`. Of those that come sooner, the newest is
    /// delivered once the period is over, so the last one of a burst is not lost, and a subscriber is woken only for what it gets. The
    /// others are not counted as lost. When the robot stops, messages that wait for their time are delivered at once.
    ///
    /// The clock is that of the run. So on virtual time a message arrives when its time has come there, and a replay delivers what
    /// its run has delivered. In a replay of a run in real time the clock is that of the journal's lines, so at the end of a period
    /// another message may be the newest.
    ///
    /// ```
    /// use bb_core::prelude::*;
    /// # robot! { robot Rover; link base { sensor wheel: External<JointState>(); } }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let builder = Rover::builder();
    /// let ten_hertz = Overflow::LatestPerPath.at_most_every(Duration::from_millis(100));
    /// let display = builder.subscribe_any(Select::Below("sensor"), None, ten_hertz);
    /// # let mut simulation = builder.simulate()?;
    /// # for position in 0..=250 {
    /// #     simulation.run_until(MonotonicTime::from_nanos(position * 1_000_000));
    /// #     let state = JointState { position: position as f64, velocity: None, effort: None };
    /// #     simulation.publish(rover::sensor::base::wheel, simulation.clock().now(), state);
    /// # }
    /// // The sensor has counted the milliseconds from 0 to 250.
    /// let newest = display.try_recv().ok_or("it has been published")?;
    /// assert_eq!(newest.downcast::<JointState>().map(|state| state.position), Some(199.0));
    /// // Those of 0 and 99 have been delivered too, and were not read.
    /// assert_eq!((display.waiting(), display.lagged()), (0, 2));
    /// # Ok(())
    /// # }
    /// ```
    pub fn at_most_every(self, period: Duration) -> Delivery {
        Delivery { overflow: self, period }
    }

    pub(super) fn bound(self) -> Bound {
        let (capacity, bytes) = match self {
            Self::DropOldest { capacity } => (capacity, Self::DEFAULT_BYTES),
            Self::DropOldestWithin { capacity, bytes } => (capacity, bytes),
            Self::KeepLatest => (1, usize::MAX),
            Self::LatestPerPath => (Self::MAX_CAPACITY, usize::MAX),
        };
        Bound { capacity: capacity.clamp(1, Self::MAX_CAPACITY), bytes }
    }
}

/// Options of a subscription: an [`Overflow`], if need be with a highest rate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Delivery {
    pub(super) overflow: Overflow,
    /// Zero for no highest rate.
    pub(super) period: Duration,
}

impl From<Overflow> for Delivery {
    fn from(overflow: Overflow) -> Self {
        Self { overflow, period: Duration::ZERO }
    }
}
