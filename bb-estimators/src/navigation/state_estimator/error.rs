//! Errors of inputs, with the reasons why an input is not in the estimate or why there is no estimate.

use core::error::Error;
use core::fmt;
use core::mem::discriminant;

use super::gate::Rejection;
use super::ids::time_of;
use crate::navigation::refusal::Refusal;

/// Reason for which an input was refused, or the side effect it had.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reason {
    /// The filter or smoother refused it.
    Refused(Refusal),
    /// There already is an input of the same kind, provider and time stamp.
    Duplicate,
    /// The gate has rejected the GNSS receiver.
    Gate(Rejection),
    /// The window has no room for more inputs.
    Overflow,
    /// Positions that did not fit have agreed on another place for long enough, and the estimate was reset to them.
    Overruled {
        /// The normalised innovation squared of the last of them, before the reset.
        nis: f64,
    },
    /// Samples of the IMU were missing, and the gap was bridged.
    Bridged,
    /// The measurement is in the estimate, but the smoother's iterations did not converge: its window restarts in the state of the filter.
    NotConverged,
}

impl Reason {
    /// Returns whether both are the same reason, whatever their numbers.
    pub(super) fn is_alike(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Refused(refusal), Self::Refused(other)) => discriminant(refusal) == discriminant(other),
            (Self::Gate(rejection), Self::Gate(other)) => rejection.is_alike(other),
            _ => discriminant(self) == discriminant(other),
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            // Keyframes are named by their times.
            Self::Refused(Refusal::NoKeyframe { id }) => {
                write!(f, "there is no keyframe at {} ns, or none any more", time_of(*id))
            }
            Self::Refused(refusal) => refusal.fmt(f),
            Self::Duplicate => f.write_str("there is one of this kind and time already"),
            Self::Gate(rejection) => rejection.fmt(f),
            Self::Overflow => f.write_str("there is no room for more inputs within the window"),
            Self::Overruled { nis } => write!(f, "the estimate was in another place (NIS {nis:.0}), and has moved"),
            Self::Bridged => f.write_str("a gap of the IMU was bridged"),
            Self::NotConverged => f.write_str("the iterations have not converged"),
        }
    }
}

impl From<Refusal> for Reason {
    fn from(refusal: Refusal) -> Self {
        Self::Refused(refusal)
    }
}

/// Error of an `add_…` method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EstimatorError {
    /// There still is an estimate: without the input, or elsewhere and less certain.
    Degraded(Reason),
    /// There is no estimate for this tick: its numbers are no longer usable, or the window overflowed. An overflow by what the flight
    /// controller sends, [`add_fc_imu`](super::FlightNavigator::add_fc_imu), is [`Degraded`](Self::Degraded).
    Fatal(Reason),
}

impl EstimatorError {
    /// The reason.
    pub fn reason(&self) -> Reason {
        match self {
            Self::Degraded(reason) | Self::Fatal(reason) => *reason,
        }
    }

    /// Returns whether there is no estimate for this tick.
    pub fn is_fatal(&self) -> bool {
        matches!(self, Self::Fatal(_))
    }

    /// Creates the error of an estimate whose numbers are no longer usable.
    pub(super) fn fatal(refusal: Refusal) -> Self {
        Self::Fatal(refusal.into())
    }

    /// Returns whether both are the same error for the same reason, whatever their numbers.
    pub(super) fn is_alike(&self, other: &Self) -> bool {
        self.is_fatal() == other.is_fatal() && self.reason().is_alike(&other.reason())
    }
}

impl From<Reason> for EstimatorError {
    fn from(reason: Reason) -> Self {
        Self::Degraded(reason)
    }
}

impl From<Refusal> for EstimatorError {
    fn from(refusal: Refusal) -> Self {
        Self::Degraded(refusal.into())
    }
}

impl fmt::Display for EstimatorError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Degraded(reason) => write!(f, "degraded: {reason}"),
            Self::Fatal(reason) => write!(f, "fatal: {reason}"),
        }
    }
}

impl Error for EstimatorError {}

/// The outcome of an input: its normalised innovation squared over its dimension, if it was measured, or its error. After a fatal error,
/// the estimate continues without the input.
pub(super) type Outcome = Result<Option<f64>, EstimatorError>;

/// Reason for which the take-off origin was refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OriginError {
    /// There already was a measurement.
    AfterMeasurement,
    /// The position or a deviation is invalid.
    Refused(Refusal),
}

impl fmt::Display for OriginError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AfterMeasurement => f.write_str("the take-off origin must be set before the first measurement"),
            Self::Refused(refusal) => write!(f, "the take-off origin is refused: {refusal}"),
        }
    }
}

impl Error for OriginError {}
