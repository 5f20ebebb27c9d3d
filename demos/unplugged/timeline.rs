//! Events as lines of a table.

use bb_core::event::{CommandEvent, CommandPhase, ParameterChange, StateTransition};
use bb_core::prelude::*;
use bb_core::{DynamicMessage, HealthTransition};
use std::fmt;

/// An event as a line of the table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Line {
    pub(crate) time: MonotonicTime,
    pub(crate) kind: Kind,
    pub(crate) event: String,
    detail: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Hardware,
    Operator,
    Health,
    Command,
    Parameter,
    State,
}

impl Kind {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Hardware => "hardware",
            Self::Operator => "operator",
            Self::Health => "health",
            Self::Command => "command",
            Self::Parameter => "parameter",
            Self::State => "state",
        }
    }
}

/// The topics in the table, in one subscription, which keeps the order across topics.
pub(crate) const TOPICS: Select<'static> = Select::AnyOf(&[
    Select::Path("health"),
    Select::Path("state_machine"),
    Select::Below("command"),
    Select::Below("param"),
]);

impl Line {
    pub(crate) fn new(
        time: MonotonicTime,
        kind: Kind,
        event: impl Into<String>,
        detail: impl Into<String>,
    ) -> Self {
        Self { time, kind, event: event.into(), detail: detail.into() }
    }

    /// Creates the line of a message from one of [`TOPICS`].
    pub(crate) fn of(message: &DynamicMessage) -> Option<Self> {
        let time = message.stamp().monotonic_time;
        if let Some(change) = message.downcast::<HealthTransition>() {
            let HealthTransition { from, to, reason, source, .. } = change.payload;
            return Some(Self::new(
                time,
                Kind::Health,
                format!("{from} -> {to}"),
                format!("{reason}: {}", short(source)),
            ));
        }
        if let Some(event) = message.downcast::<CommandEvent>() {
            let (event, detail) = description(event);
            return Some(Self::new(time, Kind::Command, event, detail));
        }
        if let Some(change) = message.downcast::<ParameterChange>() {
            let name = change.path.rsplit('/').next().unwrap_or(change.path);
            let event = format!("{name} {} -> {}", change.from, change.to);
            return Some(Self::new(time, Kind::Parameter, event, change.path));
        }
        let StateTransition { from, to, command } = message.downcast::<StateTransition>()?.payload;
        Some(Self::new(time, Kind::State, format!("{from} -> {to}"), command.unwrap_or("")))
    }

    /// The heading above the lines.
    pub(crate) fn header() -> String {
        row("time, s", "what", "", "why")
    }
}

/// Shortens a long path to its first two parts and its last two.
fn short(path: &str) -> String {
    let parts: Vec<&str> = path.split('/').collect();
    match parts.as_slice() {
        [first, second, _, .., before, last] if parts.len() > 5 => format!("{first}/{second}/…/{before}/{last}"),
        _ => path.to_owned(),
    }
}

/// Describes the progress of a command, and why it was started or refused.
fn description(event: &CommandEvent) -> (String, String) {
    let name = event.command;
    let cause =
        event.health.map_or(String::new(), |health| format!("{} is {}", short(health.estimator), health.to));
    match &event.phase {
        CommandPhase::Started => (format!("{name} started"), cause),
        CommandPhase::Refused(refusal) => {
            (format!("{name} refused"), format!("not allowed when {}", refusal.state))
        }
        CommandPhase::Succeeded => (format!("{name} finished"), String::new()),
        CommandPhase::Failed(message) => (format!("{name} failed"), message.clone()),
        CommandPhase::TimedOut => (format!("{name} timed out"), String::new()),
        CommandPhase::Cancelled => (format!("{name} cancelled"), String::new()),
        other => (name.into(), format!("{other:?}")),
    }
}

/// Returns the expected events that have not happened in their order.
pub(crate) fn missing(expected: &[(Kind, &'static str)], mut lines: &[Line]) -> Vec<(Kind, &'static str)> {
    let mut is_missing = |(kind, event): &&(Kind, &str)| {
        let position = lines.iter().position(|line| line.kind == *kind && line.event == *event);
        if let Some(position) = position {
            lines = &lines[position + 1..];
        }
        position.is_none()
    };
    expected.iter().filter(|expected| is_missing(expected)).copied().collect()
}

impl fmt::Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let seconds = format!("{:.3}", self.time.seconds_since(MonotonicTime::ZERO));
        f.write_str(&row(&seconds, self.kind.name(), &self.event, &self.detail))
    }
}

fn row(time: &str, kind: &str, event: &str, detail: &str) -> String {
    format!("{time:>7}  {kind:9}  {event:22}  {detail}").trim_end().to_owned()
}
