//! Events as structured logs.

use super::output::Parts;
use crate::navigation::state_estimator::{Event, EventKind, EventSink, Level};

/// Gives every event to `tracing`, at its level, with its fields: a subscriber that writes JSON writes one object a line.
///
/// | field | |
/// |---|---|
/// | `event` | the name of the kind |
/// | `time_ns` | when, on the clock of the inputs |
/// | `input`, `reason` | which input, and why it is not in the estimate |
/// | `from`, `to` | what changed |
/// | `nis` | of a measurement, over its dimension |
/// | `ratio` | of a covariance that has grown |
/// | `waits` | an input that is ahead of the IMU |
/// | `status_text` | what is sent to the ground |
#[derive(Clone, Copy, Debug, Default)]
pub struct TracingSink;

impl EventSink for TracingSink {
    fn event(&mut self, event: &Event) {
        macro_rules! log {
            ($level:expr) => {{
                if !tracing::enabled!($level) {
                    return;
                }
                let Parts { input, reason, from, to } = Parts::of(&event.kind);
                let (nis, waits) = match event.kind {
                    EventKind::Added { nis, waits, .. } => (nis, Some(waits)),
                    _ => (None, None),
                };
                let ratio = match event.kind {
                    EventKind::CovarianceGrowing { ratio } => Some(ratio),
                    _ => None,
                };
                let text = event.status_text();
                tracing::event!(
                    $level,
                    event = event.kind.name(),
                    time_ns = event.time_ns,
                    input,
                    reason = reason.as_deref(),
                    from,
                    to,
                    nis,
                    ratio,
                    waits,
                    status_text = text.as_ref().map(|text| text.as_str()),
                    "state estimator"
                );
            }};
        }
        match event.level() {
            Level::Error => log!(tracing::Level::ERROR),
            Level::Warn => log!(tracing::Level::WARN),
            Level::Info => log!(tracing::Level::INFO),
            Level::Debug => log!(tracing::Level::DEBUG),
        }
    }
}
