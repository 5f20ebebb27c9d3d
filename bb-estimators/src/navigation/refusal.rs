//! Reasons for rejecting a sample or a measurement.

use core::error::Error;
use core::fmt;

/// The reason why a filter rejected a sample or a measurement. The filter is unchanged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Refusal {
    /// The filter has not started.
    NotStarted,
    /// A value is NaN or infinite, or an orientation is not a rotation.
    NonFinite,
    /// A value is larger than any sensor could produce.
    OutOfRange,
    /// Time did not increase.
    TimeNotIncreasing {
        /// The time of the filter.
        previous_ns: i64,
        /// The rejected stamp.
        time_ns: i64,
    },
    /// No sample arrived for longer than can be bridged.
    Gap {
        /// The length of the gap.
        seconds: f64,
    },
    /// The covariance of a measurement is not positive definite.
    Noise,
    /// Rejected by the gate: the measurement is too far from its prediction.
    Gate {
        /// Normalised innovation squared.
        nis: f64,
        /// The threshold of the gate.
        limit: f64,
    },
    /// A relative pose refers to a keyframe that the filter does not hold.
    NoKeyframe {
        /// The keyframe it names.
        id: u64,
    },
    /// A relative pose refers to a keyframe that is held, but is not the one directly before its own, and concerns more than the two
    /// poses: their scale, which is known from one keyframe to the next. Use
    /// [`NavigationFactor::Between`](crate::navigation::NavigationFactor::Between).
    NotAdjacent {
        /// The keyframe it names.
        id: u64,
    },
    /// A keyframe has reached its maximum number of factors.
    Full {
        /// The keyframe.
        id: u64,
    },
    /// The keyframe has already observed this landmark.
    Repeated {
        /// The landmark.
        landmark: u64,
    },
    /// The measurement carries no information in this state, such as the heading of a body that points up.
    NotObservable,
    /// The measurement is older than the history.
    TooOld {
        /// The rejected stamp.
        time_ns: i64,
    },
    /// The stamp is further ahead of the newest IMU sample than the clocks may differ.
    InTheFuture {
        /// The rejected stamp.
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
            Self::NotAdjacent { id } => {
                write!(f, "keyframe {id} is not the one directly before, and more than the poses is compared")
            }
            Self::Full { id } => write!(f, "keyframe {id} has as many factors as it takes"),
            Self::Repeated { landmark } => write!(f, "the keyframe has seen landmark {landmark} already"),
            Self::NotObservable => f.write_str("the measurement says nothing in this state"),
            Self::TooOld { time_ns } => write!(f, "time stamp {time_ns} ns is older than the history"),
            Self::InTheFuture { time_ns } => write!(f, "time stamp {time_ns} ns is in the future"),
        }
    }
}

impl Error for Refusal {}
