//! Telemetry events for handlers of the user: inputs, outputs, callbacks, drops, changes of health and faults.

use crate::declaration::EstimatorDeclaration;
use crate::event::{ComponentFault, HealthTransition};
use crate::fault::{guarded, log_panic};
use crate::message::{Payload, Stamp, Stamped};
use crate::time::MonotonicTime;
use bb_message::__private::Sorted;
use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// An event of a running robot.
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
        /// The path of the estimator.
        estimator: &'static str,
        /// The name of the output: `out` unless one is declared.
        output: &'static str,
        /// The name of the payload's type.
        payload: &'static str,
        /// The path it was published at.
        path: &'static str,
        /// The message's stamp.
        stamp: Stamp,
        /// Time from the stamp, which is that of the driving input's message unless it is [`Timed`](crate::Timed), to the emission.
        age: Duration,
    },
    /// A callback returned.
    Latency {
        /// The path of the estimator.
        estimator: &'static str,
        /// Duration of the callback.
        duration: Duration,
    },
    /// A message or a dispatch was dropped.
    Dropped {
        /// The path of the estimator.
        estimator: &'static str,
        /// The name of the input.
        input: &'static str,
        /// Reason for the drop.
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
#[derive(Clone)]
pub(crate) struct Telemetry {
    handlers: Vec<Handler>,
    /// Number of panics of the handlers.
    panics: Arc<AtomicU64>,
    /// The estimator and the output that publish at a path.
    outputs: Sorted<&'static str, (&'static str, &'static str)>,
}

impl Telemetry {
    pub(crate) fn new(handlers: Vec<Handler>, estimators: &[EstimatorDeclaration]) -> Self {
        let mut outputs = Sorted::default();
        for estimator in estimators {
            for (path, name) in estimator.outputs.iter().zip(estimator.output_names) {
                outputs.insert(*path, (estimator.path, *name));
            }
        }
        Self { handlers, panics: Arc::default(), outputs }
    }

    #[cold]
    pub(crate) fn tell(&self, robot: &'static str, event: &TelemetryEvent) {
        for handler in &self.handlers {
            if let Err(fault) = guarded(|| handler(robot, event)) {
                self.panics.fetch_add(1, Ordering::Relaxed);
                log_panic("a handler of telemetry failed", &fault);
            }
        }
    }

    pub(crate) fn panics(&self) -> u64 {
        self.panics.load(Ordering::Relaxed)
    }

    pub(crate) fn output<T: Payload>(
        &self,
        robot: &'static str,
        path: &'static str,
        message: &Stamped<T>,
        now: MonotonicTime,
    ) {
        let (estimator, output) = self.outputs.get(path).copied().unwrap_or_default();
        let (payload, stamp) = (T::NAME, message.stamp());
        let age = now.duration_since(message.monotonic_time);
        self.tell(robot, &TelemetryEvent::Output { estimator, output, payload, path, stamp, age });
    }
}

impl fmt::Debug for Telemetry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Telemetry").field(&self.handlers.len()).finish()
    }
}
