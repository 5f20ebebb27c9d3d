//! Status and counters of joints.

use crate::time::MonotonicTime;
use std::fmt;

/// Why a joint's state was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum JointRefusal {
    /// The state was older than the last state of its joint.
    OutOfOrder,
    /// The state had the same stamp as the last state of its joint.
    Duplicate,
    /// The state held a NaN or an infinity, or a rotation without direction.
    NonFinite,
    /// The state's stamp was more than a second ahead of the clock.
    ClockSkew,
    /// The number of coordinates differed from the joint's.
    OtherCoordinates,
}

impl JointRefusal {
    /// All reasons.
    pub const ALL: &'static [Self] =
        &[Self::OutOfOrder, Self::Duplicate, Self::NonFinite, Self::ClockSkew, Self::OtherCoordinates];

    /// The human-readable name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::OutOfOrder => "out of order",
            Self::Duplicate => "duplicate",
            Self::NonFinite => "non-finite",
            Self::ClockSkew => "clock skew",
            Self::OtherCoordinates => "other coordinates",
        }
    }
}

pub(super) const REFUSALS: usize = JointRefusal::ALL.len();

/// The counts of a joint since the start.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct JointStatistics {
    /// Its name, or the name given in a message if there is no such joint.
    pub joint: String,
    /// Whether the robot declares it.
    pub is_declared: bool,
    /// States accepted.
    pub states: u64,
    /// States of an unknown joint.
    pub unknown: u64,
    pub(super) refused: [u64; REFUSALS],
}

impl JointStatistics {
    /// How many states were refused for `reason`.
    pub fn refused(&self, reason: JointRefusal) -> u64 {
        self.refused[reason as usize]
    }
}

impl fmt::Display for JointStatistics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let joint = &self.joint;
        if !self.is_declared {
            return write!(f, "{} states of `{joint}`, which is no moving joint of this robot", self.unknown);
        }
        write!(f, "joint {joint}: {} states", self.states)?;
        for reason in JointRefusal::ALL.iter().copied().filter(|reason| self.refused(*reason) > 0) {
            write!(f, ", {} refused: {}", self.refused(reason), reason.name())?;
        }
        Ok(())
    }
}

/// The current status of a joint.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct JointStatus {
    /// Its name.
    pub joint: &'static str,
    /// The stamp of its newest state; `None` if its state is unknown.
    pub time: Option<MonotonicTime>,
    /// Whether that state is older than [`JointSettings::stale_after`](super::JointSettings).
    pub is_stale: bool,
    /// Its position at that time, with one number for each coordinate; empty if its state is unknown.
    pub position: Vec<f64>,
    /// Its velocity at that time; empty if it was not measured.
    pub velocity: Vec<f64>,
    /// Its mean acceleration over the last 50 ms, or between the last two states if they are further apart; empty unless the velocity
    /// was measured at both ends.
    pub acceleration: Vec<f64>,
    /// Its effort at that time; empty if it was not measured.
    pub effort: Vec<f64>,
}
