//! Inputs in the order in which they are applied.

use super::error::Reason;
use super::event::InputKind;
use super::gate::Rejection;
use super::input::{AttitudeReading, FlightControllerState, GnssReading, GpsHealth, PoseAnchor, VioOutput};

/// The position of an input in the queue: its stamp, then its kind. Keys are unique.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Key {
    pub(super) time_ns: i64,
    rank: u8,
    provider: u32,
}

impl Key {
    /// Before all inputs.
    pub(super) const FIRST: Self = Self { time_ns: i64::MIN, rank: 0, provider: 0 };

    /// A sample of the IMU precedes measurements at its end.
    pub(super) const fn of_sample(time_ns: i64) -> Self {
        Self { time_ns, rank: 0, provider: 0 }
    }

    /// After all inputs of that time.
    pub(super) const fn end_of(time_ns: i64) -> Self {
        Self { time_ns, rank: u8::MAX, provider: u32::MAX }
    }
}

/// An input other than a sample of the IMU.
#[derive(Clone, Debug)]
pub(super) enum Payload<F> {
    Warm(FlightControllerState),
    Attitude(AttitudeReading),
    Health(GpsHealth),
    /// A camera has captured a frame: relative poses begin and end at frames.
    Frame,
    Vio(VioOutput),
    Anchor(PoseAnchor),
    Gnss(GnssReading),
    Provided(u32, F),
}

impl<F> Payload<F> {
    pub(super) fn key(&self, time_ns: i64) -> Key {
        let (rank, provider) = match self {
            Self::Warm(_) => (1, 0),
            Self::Attitude(_) => (2, 0),
            Self::Health(_) => (3, 0),
            Self::Frame => (4, 0),
            Self::Vio(_) => (5, 0),
            Self::Anchor(anchor) => (6, anchor.provider),
            Self::Gnss(_) => (7, 0),
            Self::Provided(provider, _) => (8, *provider),
        };
        Key { time_ns, rank, provider }
    }

    /// `None` for entries that no user has added.
    pub(super) fn kind(&self) -> Option<InputKind> {
        Some(match self {
            Self::Warm(_) => InputKind::WarmStart,
            Self::Attitude(_) => InputKind::Attitude,
            Self::Health(_) => InputKind::Health,
            Self::Frame => return None,
            Self::Vio(_) => InputKind::Vio,
            Self::Anchor(_) => InputKind::Anchor,
            Self::Gnss(_) => InputKind::Gnss,
            Self::Provided(..) => InputKind::Factor,
        })
    }
}

/// Result of an input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Outcome {
    /// It is in the estimate.
    Added {
        /// Normalised innovation squared over its dimension.
        nis: Option<f64>,
    },
    /// It is not in the estimate, or only with the covariance raised.
    Degraded(Reason),
    /// It broke the estimate, which continues without it.
    Fatal(Reason),
}

impl Outcome {
    /// The reason, if the input is not in the estimate or degraded it.
    pub(super) fn reason(&self) -> Option<Reason> {
        match self {
            Self::Added { .. } => None,
            Self::Degraded(reason) | Self::Fatal(reason) => Some(*reason),
        }
    }
}

/// An input at its position in the queue.
#[derive(Clone, Debug)]
pub(super) struct Entry<F> {
    pub(super) key: Key,
    pub(super) payload: Payload<F>,
    /// `None` until it is first applied.
    pub(super) outcome: Option<Outcome>,
    /// Rejection by the gate of the receiver.
    pub(super) rejection: Option<Rejection>,
}
