//! What must happen, and in which order.

use crate::timeline::{Kind, Line};

/// What belongs to the story, without its times.
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

/// What of it has not happened, or not after what comes before it.
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
