//! Inputs in the order in which they are applied.

use alloc::boxed::Box;
use alloc::vec::Vec;

use super::error::{EstimatorError, Outcome, Reason};
use super::event::{EventKind, InputKind};
use super::gate::Rejection;
use super::given::{FactorForm, GivenFactor};
use super::input::{
    AttitudeReading, Feature, FlightControllerState, GnssReading, GpsHealth, PoseAnchor, VioOutput,
};
use crate::navigation::history::past::Key;

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
    Given(Box<GivenFactor>),
    Features(Vec<Feature>),
}

impl<F> Payload<F> {
    /// Place in the queue. Of one kind, the number of the provider counts; of reports, the worse comes later, and of relative poses the
    /// longer.
    pub(super) fn key(&self, time_ns: i64) -> Key {
        let (rank, order) = match self {
            Self::Warm(_) => (1, 0),
            Self::Attitude(_) => (2, 0),
            Self::Health(health) => (3, u64::from(health.severity())),
            Self::Frame => (4, 0),
            Self::Vio(vio) => (5, span(vio.from_ns, vio.to_ns)),
            Self::Anchor(anchor) => (6, u64::from(anchor.provider)),
            Self::Gnss(_) => (7, 0),
            Self::Provided(provider, _) => (8, u64::from(*provider)),
            Self::Given(given) => {
                let provider = u64::from(given.provider) << 32;
                match &given.form {
                    FactorForm::Linear(_) => (9, provider),
                    FactorForm::Relative(relative) => (10, provider | span(relative.from_ns, given.time_ns)),
                }
            }
            // The gate of landmarks uses what else is known of their keyframe.
            Self::Features(_) => (11, 0),
        };
        Key { time_ns, rank, order }
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
            Self::Provided(..) | Self::Given(_) => InputKind::Factor,
            Self::Features(_) => InputKind::Features,
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

/// Time between two keyframes in units that fit half a number, about a microsecond.
fn span(from_ns: i64, to_ns: i64) -> u64 {
    (to_ns.abs_diff(from_ns) / 1000).min(u64::from(u32::MAX))
}

/// An input in the queue.
#[derive(Clone, Debug)]
pub(super) struct Entry<F> {
    pub(super) payload: Payload<F>,
    /// `None` until it is first applied.
    pub(super) outcome: Option<Outcome>,
    /// Rejection by the gate of the receiver.
    pub(super) rejection: Option<Rejection>,
}

impl<F> Entry<F> {
    /// Takes what it has become, and returns what is news of that.
    pub(super) fn became(&mut self, outcome: Outcome, rejection: Option<Rejection>) -> [Option<EventKind>; 2] {
        let input = self.payload.kind();
        let is_alike = |before: Outcome| match (before, outcome) {
            (Ok(_), Ok(_)) => true,
            (Err(before), Err(error)) => before.is_alike(&error),
            _ => false,
        };
        let is_news = self.outcome.is_none_or(|before| !is_alike(before));
        let news = match (self.outcome, outcome) {
            (None, Ok(_)) if !self.payload.is_added() => None,
            // An anchor may be in the estimate, and let the receiver in after all.
            (Some(_), Ok(_)) => {
                let is_revised = is_news || (self.rejection.is_some() && rejection.is_none());
                is_revised.then_some(EventKind::Revised { input })
            }
            // The rejection reports it.
            (_, Err(EstimatorError::Degraded(Reason::Gate(_)))) => None,
            _ => is_news.then_some(EventKind::of(input, outcome)),
        };
        let is_same = |rejection: &Rejection| self.rejection.is_some_and(|before| before.is_alike(rejection));
        let rejected = rejection.filter(|rejection| !is_same(rejection));
        (self.outcome, self.rejection) = (Some(outcome), rejection);
        [news, rejected.map(|rejection| EventKind::Rejected { rejection })]
    }
}
