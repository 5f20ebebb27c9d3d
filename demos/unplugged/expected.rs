//! Events that must happen, in their order.

use crate::timeline::Kind;

/// Events of the story, without their times.
pub(crate) const EXPECTED: &[(Kind, &str)] = &[
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
