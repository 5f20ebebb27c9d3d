//! Events from outside: the arm's operator, and a cable that is unplugged.

use crate::timeline::{Kind, Line};
use bb_core::prelude::*;

/// Something that is done from outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Deed {
    Arm,
    Follow,
    Unplug,
    Plug,
    Disarm,
}

/// Deeds and their times.
pub(crate) const STEPS: [(MonotonicTime, Deed); 5] = [
    (at(500), Deed::Arm),
    (at(1000), Deed::Follow),
    (at(4000), Deed::Unplug),
    (at(6000), Deed::Plug),
    (at(15_000), Deed::Disarm),
];

/// Time at which the story ends.
pub(crate) const END: MonotonicTime = at(15_500);

/// Period at which events are written down.
pub(crate) const PERIOD: Duration = Duration::from_millis(100);

impl Deed {
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
