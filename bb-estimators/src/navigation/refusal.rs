//! Why a sample or a measurement is not taken.

use core::error::Error;
use core::fmt;

/// Why a filter refused a sample or a measurement; it is as it was before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Refusal {
    /// The filter has not started.
    NotStarted,
    /// A value is NaN or infinite, or an orientation is no rotation.
    NonFinite,
    /// A value is larger than any sensor's.
    OutOfRange,
    /// Time stands still or runs back.
    TimeNotIncreasing {
        /// The time of the filter.
        previous_ns: i64,
        /// The stamp that was refused.
        time_ns: i64,
    },
    /// Nothing was measured for longer than can be bridged.
    Gap {
        /// How long.
        seconds: f64,
    },
    /// The covariance of a measurement is not positive definite.
    Noise,
    /// The gate: what was measured and what was expected are too far apart.
    Gate {
        /// Normalised innovation squared.
        nis: f64,
        /// What the gate lets pass.
        limit: f64,
    },
    /// A relative pose refers to a keyframe that the filter does not hold.
    NoKeyframe {
        /// The keyframe it names.
        id: u64,
    },
    /// A keyframe has as many factors as it takes.
    Full {
        /// The keyframe.
        id: u64,
    },
    /// The keyframe has seen this landmark already.
    Repeated {
        /// The landmark.
        landmark: u64,
    },
    /// The measurement says nothing in this state: the heading of a body that points up, say.
    NotObservable,
    /// Older than the history reaches.
    TooOld {
        /// The stamp that was refused.
        time_ns: i64,
    },
    /// Stamped after the newest sample of the IMU by more than a clock may be off.
    InTheFuture {
        /// The stamp that was refused.
        time_ns: i64,
    },
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotStarted => f.write_str("the filter has not started"),
            Self::NonFinite => f.write_str("a value is not finite"),
            Self::OutOfRange => f.write_str("a value is beyond the range of any sensor"),
            Self::TimeNotIncreasing { previous_ns, time_ns } => {
                write!(f, "time stamp {time_ns} ns does not follow {previous_ns} ns")
            }
            Self::Gap { seconds } => write!(f, "no sample for {seconds} s, which is too long to bridge"),
            Self::Noise => f.write_str("the covariance is not positive definite"),
            Self::Gate { nis, limit } => {
                write!(f, "normalised innovation squared is {nis:.1}, beyond the gate of {limit:.1}")
            }
            Self::NoKeyframe { id } => write!(f, "keyframe {id} is not held"),
            Self::Full { id } => write!(f, "keyframe {id} has as many factors as it takes"),
            Self::Repeated { landmark } => write!(f, "the keyframe has seen landmark {landmark} already"),
            Self::NotObservable => f.write_str("the measurement says nothing in this state"),
            Self::TooOld { time_ns } => write!(f, "time stamp {time_ns} ns is older than the history"),
            Self::InTheFuture { time_ns } => write!(f, "time stamp {time_ns} ns is in the future"),
        }
    }
}

impl Error for Refusal {}
