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
    /// The number of a provider; of reports at one time, the worse comes later, and counts.
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
            Self::Health(health) => (3, health.severity()),
            Self::Frame => (4, 0),
            Self::Vio(_) => (5, 0),
            Self::Anchor(anchor) => (6, anchor.provider),
            Self::Gnss(_) => (7, 0),
            Self::Provided(provider, _) => (8, *provider),
        };
        Key { time_ns, rank, provider }
    }

    pub(super) fn kind(&self) -> InputKind {
        match self {
            Self::Warm(_) => InputKind::WarmStart,
            Self::Attitude(_) => InputKind::Attitude,
            Self::Health(_) => InputKind::Health,
            Self::Frame => InputKind::Frame,
            Self::Vio(_) => InputKind::Vio,
            Self::Anchor(_) => InputKind::Anchor,
            Self::Gnss(_) => InputKind::Gnss,
            Self::Provided(..) => InputKind::Factor,
        }
    }

    /// Returns whether it must not be lost: a report of spoofing.
    pub(super) fn is_alarm(&self) -> bool {
        matches!(self, Self::Health(GpsHealth::Spoofed))
    }

    /// Returns whether a user has added it. A frame comes with a relative pose, which is reported instead unless the frame fails.
    pub(super) fn is_added(&self) -> bool {
        !matches!(self, Self::Frame)
    }
}

/// Result of an input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Outcome {
    /// Input that is in the estimate.
    Added {
        /// Normalised innovation squared over its dimension.
        nis: Option<f64>,
    },
    /// The position is not in the estimate, or has moved it.
    Degraded(Reason),
    /// Input that broke the estimate, which continues without it.
    Fatal(Reason),
}

impl Outcome {
    /// Returns whether the input became the same, for the same reason. The numbers may differ.
    pub(super) fn is_alike(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Added { .. }, Self::Added { .. }) => true,
            (Self::Degraded(reason), Self::Degraded(other)) | (Self::Fatal(reason), Self::Fatal(other)) => {
                reason.is_alike(other)
            }
            _ => false,
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

/// Change of an input that is to be reported.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum News {
    /// Result of the input, for the first time or instead of another one.
    Became(Outcome),
    /// Input that is in the estimate after all.
    Revised,
}

impl<F> Entry<F> {
    /// Takes what it has become, and returns what is news of that.
    pub(super) fn became(
        &mut self,
        outcome: Outcome,
        rejection: Option<Rejection>,
    ) -> (Option<News>, Option<Rejection>) {
        let is_news = self.outcome.is_none_or(|before| !before.is_alike(&outcome));
        let news = match (self.outcome, outcome) {
            (None, Outcome::Added { .. }) if !self.payload.is_added() => None,
            // An anchor may be in the estimate, and let the receiver in after all.
            (Some(_), Outcome::Added { .. }) if is_news || (self.rejection.is_some() && rejection.is_none()) => {
                Some(News::Revised)
            }
            (_, outcome) => is_news.then_some(News::Became(outcome)),
        };
        let is_same = |rejection: &Rejection| self.rejection.is_some_and(|before| before.is_alike(rejection));
        let rejected = rejection.filter(|rejection| !is_same(rejection));
        (self.outcome, self.rejection) = (Some(outcome), rejection);
        (news, rejected)
    }
}
