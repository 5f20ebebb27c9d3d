//! Why an input is not in the estimate, or why there is no estimate.

use core::error::Error;
use core::fmt;

use super::gate::Rejection;
use crate::navigation::refusal::Refusal;

/// What is wrong with an input, or came of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reason {
    /// The filter or smoother refuses it.
    Refused(Refusal),
    /// There is one of the same kind, provider and time stamp already.
    Duplicate,
    /// The receiver of satellite navigation is not let in.
    Gate(Rejection),
    /// There are as many inputs within the window as it has room for.
    Overflow,
    /// The measurement was taken in, but only after the covariance was raised: it did not fit three times in a row.
    Raised {
        /// By which factor.
        factor: f64,
    },
    /// Samples of the IMU were missing and the gap was bridged.
    Bridged,
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Refused(refusal) => refusal.fmt(f),
            Self::Duplicate => f.write_str("there is one of this kind and time already"),
            Self::Gate(rejection) => rejection.fmt(f),
            Self::Overflow => f.write_str("there is no room for more inputs within the window"),
            Self::Raised { factor } => write!(f, "it does not fit: the covariance was raised by {factor:.1}"),
            Self::Bridged => f.write_str("a gap of the IMU was bridged"),
        }
    }
}

impl From<Refusal> for Reason {
    fn from(refusal: Refusal) -> Self {
        Self::Refused(refusal)
    }
}

/// What an `add_…` failed with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EstimatorError {
    /// There is an estimate all the same: without the input, or with its covariance raised.
    Degraded(Reason),
    /// There is no estimate for this tick: its numbers are no longer any good, or the window overflows.
    Fatal(Reason),
}

impl EstimatorError {
    /// Why.
    pub fn reason(&self) -> Reason {
        match self {
            Self::Degraded(reason) | Self::Fatal(reason) => *reason,
        }
    }

    /// Whether there is no estimate for this tick.
    pub fn is_fatal(&self) -> bool {
        matches!(self, Self::Fatal(_))
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

/// Why the take-off origin is not taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OriginError {
    /// There has been a measurement already.
    AfterMeasurement,
    /// It is no position, or its deviations are none.
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
