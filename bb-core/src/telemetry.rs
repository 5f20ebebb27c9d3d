//! Events for handlers that a user attaches: every input, output, latency, drop and transition.

use crate::event::{ComponentFault, HealthTransition};
use crate::fault::guarded;
use crate::message::{Payload, Stamp, Stamped};
use crate::time::MonotonicTime;
use std::fmt;
use std::sync::Arc;
use std::time::Duration;

/// Something that happened while a robot runs.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum TelemetryEvent {
    /// A message reached an estimator.
    Input {
        /// The path of the estimator.
        estimator: &'static str,
        /// The name of the input.
        input: &'static str,
        /// The message's stamp.
        stamp: Stamp,
    },
    /// An estimator emitted a message.
    Output {
        /// The path it was published at.
        path: &'static str,
        /// The message's stamp.
        stamp: Stamp,
        /// From the stamp, which is that of the driver's message, to the emission.
        age: Duration,
    },
    /// A callback returned; measured where a `latency_budget` is declared, else for every 64th callback.
    Latency {
        /// The path of the estimator.
        estimator: &'static str,
        /// How long it took.
        duration: Duration,
    },
    /// A message or a dispatch was dropped.
    Dropped {
        /// The path of the estimator.
        estimator: &'static str,
        /// The name of the input.
        input: &'static str,
        /// Why.
        reason: &'static str,
    },
    /// The health of an estimator has changed.
    Transition(HealthTransition),
    /// A component has failed.
    Fault(ComponentFault),
}

/// A handler of telemetry: it gets the robot's name and the event.
pub type Handler = Arc<dyn Fn(&'static str, &TelemetryEvent) + Send + Sync>;

/// The handlers of one run.
#[derive(Clone, Default)]
pub(crate) struct Telemetry(Vec<Handler>);

impl Telemetry {
    pub(crate) fn add(&mut self, handler: Handler) {
        self.0.push(handler);
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    #[cold]
    pub(crate) fn tell(&self, robot: &'static str, event: &TelemetryEvent) {
        for handler in &self.0 {
            if let Err(fault) = guarded(|| handler(robot, event)) {
                tracing::error!(%fault, "a handler of telemetry failed");
            }
        }
    }

    pub(crate) fn output<T: Payload>(
        &self,
        robot: &'static str,
        path: &'static str,
        message: &Stamped<T>,
        now: MonotonicTime,
    ) {
        let age = now.duration_since(message.monotonic_time);
        self.tell(robot, &TelemetryEvent::Output { path, stamp: message.stamp(), age });
    }
}

impl fmt::Debug for Telemetry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Telemetry").field(&self.0.len()).finish()
    }
}
