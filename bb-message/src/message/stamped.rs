//! A payload with its time, frame and origin.

use super::Payload;
use crate::time::{MonotonicTime, WallTime};
use std::fmt;
use std::ops::Deref;

/// The name of a coordinate frame: that of a link or a joint, or empty for no frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Frame(&'static str);

impl Frame {
    /// No frame: for sensors of the robot as a whole.
    pub const NONE: Self = Self("");

    /// The frame `name`.
    #[inline]
    pub const fn new(name: &'static str) -> Self {
        Self(name)
    }

    /// Returns the name of the link or joint.
    #[inline]
    pub const fn name(self) -> &'static str {
        self.0
    }
}

impl fmt::Display for Frame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.0)
    }
}

/// Place at which a message was first published.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Origin {
    /// The robot's name.
    pub robot: &'static str,
    /// The name of the node (machine or process) that runs it.
    pub node: &'static str,
}

/// All of a message but its payload.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stamp {
    /// Time of the measurement, on the monotonic clock: for order and age.
    pub monotonic_time: MonotonicTime,
    /// Time of the measurement, by the calendar: for logs.
    pub wall_time: WallTime,
    /// The frame the payload is in.
    pub frame: Frame,
    /// Place at which the message was published.
    pub origin: Origin,
}

impl Stamp {
    /// A message with this stamp.
    pub fn message<T>(self, payload: T) -> Stamped<T> {
        let Self { monotonic_time, wall_time, frame, origin } = self;
        Stamped { payload, monotonic_time, wall_time, frame, origin }
    }

    /// The stamp of a message from elsewhere: without a wall time it gets that of its monotonic time, given both `now`; without a frame,
    /// `frame`.
    #[doc(hidden)]
    pub fn completed(mut self, now: Self, frame: Frame) -> Self {
        if self.wall_time == WallTime::default() {
            let age = now.monotonic_time.nanos_since(self.monotonic_time);
            self.wall_time = WallTime::from_unix_nanos(now.wall_time.as_unix_nanos().saturating_sub(age));
        }
        if self.frame == Frame::NONE {
            self.frame = frame;
        }
        self
    }
}

/// A message: a payload, when it was measured, in which frame, and where. Dereferences to its payload.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stamped<T> {
    /// The data, in SI units.
    pub payload: T,
    /// Time of the measurement, on this machine's monotonic clock: for order and age.
    pub monotonic_time: MonotonicTime,
    /// Time of the measurement, by the calendar: for logs.
    pub wall_time: WallTime,
    /// The frame the payload is in.
    pub frame: Frame,
    /// Place at which the message was published.
    pub origin: Origin,
}

impl<T> Stamped<T> {
    /// A message measured at `monotonic_time`, in no frame, of no robot: for tests of plain estimators.
    pub fn new(monotonic_time: MonotonicTime, payload: T) -> Self {
        Stamp { monotonic_time, ..Stamp::default() }.message(payload)
    }

    /// All but the payload.
    pub fn stamp(&self) -> Stamp {
        Stamp {
            monotonic_time: self.monotonic_time,
            wall_time: self.wall_time,
            frame: self.frame,
            origin: self.origin,
        }
    }
}

impl<T> Deref for Stamped<T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.payload
    }
}

/// Marker that says whether two payloads are known: it is computed once for all publishers and inputs of the same types.
#[derive(Debug)]
pub struct BothKnown<const KNOWN: bool>;

/// A payload whose publisher may feed an input of type `T`. It may if the types are equal, or if one of them is unknown because of
/// another error.
///
/// The wiring names it at every `input`, where a mismatch is reported. `K` is a [`BothKnown`].
#[diagnostic::on_unimplemented(
    message = "this publishes `{Self}`, but the estimator's input takes `{T}`",
    label = "publishes `{Self}`, not `{T}`",
    note = "an estimator that takes several kinds of messages names the one here, as in `Mekf<Marg>`; other messages \
            come from another sensor, or from an estimator that converts them"
)]
pub trait Feeds<T: Payload, K>: Payload {
    /// Returns the same message.
    fn feed(message: &Stamped<Self>) -> &Stamped<T>;
}

impl<T: Payload> Feeds<T, BothKnown<true>> for T {
    #[inline(always)]
    fn feed(message: &Stamped<T>) -> &Stamped<T> {
        message
    }
}

impl<P: Payload, T: Payload> Feeds<T, BothKnown<false>> for P {
    #[expect(clippy::panic, reason = "named only by a robot that did not verify, which does not compile")]
    fn feed(_: &Stamped<P>) -> &Stamped<T> {
        panic!("this robot did not verify")
    }
}
