//! Actions from outside: commands of the arm's operator, and a cable that is unplugged.

use crate::timeline::{Kind, Line};
use bb_core::prelude::*;

/// An action from outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Action {
    Arm,
    Follow,
    Unplug,
    Plug,
    Disarm,
}

/// Actions and their times.
pub(crate) const STEPS: [(MonotonicTime, Action); 5] = [
    (at(500), Action::Arm),
    (at(1000), Action::Follow),
    (at(4000), Action::Unplug),
    (at(6000), Action::Plug),
    (at(15_000), Action::Disarm),
];

/// Time at which the story ends.
pub(crate) const END: MonotonicTime = at(15_500);

/// Period at which events are printed.
pub(crate) const PERIOD: Duration = Duration::from_millis(100);

impl Action {
    pub(crate) fn line(self, time: MonotonicTime) -> Line {
        let (kind, event, detail) = match self {
            Self::Arm => (Kind::Operator, "arm!", ""),
            Self::Follow => (Kind::Operator, "follow!", ""),
            Self::Unplug => (Kind::Hardware, "the IMU is unplugged", "that of the tip, while the arm moves"),
            Self::Plug => (Kind::Hardware, "the IMU is plugged in", ""),
            Self::Disarm => (Kind::Operator, "disarm!", ""),
        };
        Line::new(time, kind, event, detail)
    }
}

const fn at(millis: i64) -> MonotonicTime {
    MonotonicTime::from_nanos(millis * 1_000_000)
}
