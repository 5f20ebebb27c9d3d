//! Status and counters of joints.

use bb_message::time::MonotonicTime;
use std::fmt;

/// Reason for which a joint's state was refused.
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
    /// Name of the joint, or the name given in a message if there is no such joint.
    pub joint: String,
    /// `true` if the robot declares the joint.
    pub is_declared: bool,
    /// States accepted.
    pub states: u64,
    /// States of an unknown joint.
    pub unknown: u64,
    pub(super) refused: [u64; REFUSALS],
}

impl JointStatistics {
    /// Returns the number of states that were refused for `reason`.
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
    /// Name of the joint.
    pub joint: &'static str,
    /// The stamp of its newest state; `None` if its state is unknown.
    pub time: Option<MonotonicTime>,
    /// `true` if that state is older than [`JointSettings::stale_after`](super::JointSettings).
    pub is_stale: bool,
    /// Position at that time, with one number for each coordinate; empty if the state is unknown.
    pub position: Vec<f64>,
    /// Velocity at that time; empty if it was not measured.
    pub velocity: Vec<f64>,
    /// Mean acceleration over the last 50 ms, or between the last two states if they are further apart; empty unless the velocity was
    /// measured at both ends.
    pub acceleration: Vec<f64>,
    /// Effort at that time; empty if it was not measured.
    pub effort: Vec<f64>,
}
