//! Events that must happen, in their order.

use crate::timeline::{Kind, Line};

/// Events of the story, without their times.
const EXPECTED: &[(Kind, &str)] = &[
    (Kind::State, "disarmed -> idle"),
    (Kind::Command, "drive started"),
    (Kind::State, "executing -> driving"),
    (Kind::Health, "healthy -> degraded"),
    (Kind::Command, "slow_down started"),
    (Kind::Parameter, "speed 1.0 -> 0.3"),
    (Kind::Command, "slow_down finished"),
    (Kind::State, "driving -> slow"),
    (Kind::Health, "degraded -> healthy"),
    (Kind::Command, "resume started"),
    (Kind::State, "slow -> driving"),
    (Kind::Health, "healthy -> lost"),
    (Kind::Command, "stop started"),
    (Kind::Parameter, "speed 1.0 -> 0.0"),
    (Kind::Command, "stop finished"),
    (Kind::State, "driving -> stopped"),
    (Kind::Command, "drive refused"),
    (Kind::Health, "lost -> degraded"),
    (Kind::Health, "degraded -> healthy"),
    (Kind::Command, "resume started"),
    (Kind::Parameter, "speed 0.0 -> 1.0"),
    (Kind::Command, "resume finished"),
    (Kind::State, "stopped -> driving"),
    (Kind::Command, "disarm finished"),
];

/// Returns the events of the story that have not happened, or not after what comes before them.
pub(crate) fn missing(lines: &[Line]) -> Vec<(Kind, &'static str)> {
    let mut rest = lines;
    let mut is_missing = |(kind, event): &&(Kind, &str)| {
        let position = rest.iter().position(|line| line.kind == *kind && line.event == *event);
        if let Some(position) = position {
            rest = &rest[position + 1..];
        }
        position.is_none()
    };
    EXPECTED.iter().filter(|expected| is_missing(expected)).copied().collect()
}
