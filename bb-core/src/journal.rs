//! What comes into a robot from outside, in the order in which it was taken in: enough to run it again, bit for bit.
//!
//! Between estimators everything follows from what they are given, so it suffices to know what each island took in, in
//! which order and at what time; messages of sensors, controllers and bridges with their payloads; parameters, commands and
//! arming from outside; and what depends on how long something took. [`Builder::journal`](crate::Builder::journal) writes
//! such a journal, [`Builder::replay`](crate::Builder::replay) runs the robot again from it, on virtual time, without its
//! sensors, services and actuators.
//!
//! Not in a journal: requests to estimators ([`Live::call`](crate::Live::call), [`Live::cast`](crate::Live::cast)) and the
//! arguments of commands, which may be of any type; a command replayed has its default ones.

mod line;

pub use line::{JournalLine, JournalReader};

use crate::control::{ParameterValue, SafetyError};
use crate::node::HealthTransition;
use crate::pubsub::DynamicMessage;
use crate::time::MonotonicTime;
use std::cell::Cell;
use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// One line of a journal.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Its number: lines are handed over in any order, and replayed in this one.
    pub number: u64,
    /// The time of the robot's clock.
    pub time: MonotonicTime,
    /// What happened.
    pub event: Event,
}

/// See [`Entry`].
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Event {
    /// A sensor or a service published, or somebody for it.
    Message {
        /// The number of the publisher.
        publisher: usize,
        /// What.
        message: DynamicMessage,
    },
    /// An island took in a message.
    Deliver {
        /// The number of the island.
        island: usize,
        /// Which of its publishers, as the island numbers them.
        entry: usize,
        /// The number of the message's line; 0 for one that another island has published.
        message: u64,
    },
    /// A message did not fit in the inbox of an island.
    Drop {
        /// The number of the island.
        island: usize,
        /// As in [`Event::Deliver`].
        entry: usize,
        /// As in [`Event::Deliver`].
        message: u64,
    },
    /// An island looked what was due.
    Wake {
        /// The number of the island.
        island: usize,
    },
    /// A callback took longer than its `latency_budget`.
    Overrun {
        /// The number of the line that the callback followed from.
        cause: u64,
        /// The number of the estimator.
        estimator: usize,
    },
    /// Something could not be made safe.
    Unsafe {
        /// The number of the line with which disarming began.
        cause: u64,
        /// What, and why.
        errors: Vec<SafetyError>,
    },
    /// A sensor or a service failed, which its supervisor counts.
    Failed {
        /// The number of the supervisor.
        supervisor: usize,
        /// The path of what failed.
        path: &'static str,
    },
    /// A parameter was set from outside.
    Parameter {
        /// Its number.
        parameter: usize,
        /// To what.
        value: ParameterValue,
    },
    /// A command was asked for from outside.
    Command {
        /// Its number.
        command: usize,
    },
    /// Commands went on.
    Drive {
        /// The changes of health whose commands were started then.
        health: Vec<HealthTransition>,
        /// The components that had failed too often, and were given up then.
        given_up: Vec<&'static str>,
    },
    /// The robot was stopped.
    Stop,
    /// The robot was armed from outside.
    Arm,
    /// The robot was disarmed from outside.
    Disarm {
        /// Whatever its state.
        force: bool,
    },
}

/// Where lines go. It is called on whatever thread something happens, so it must be quick; what it does with too many
/// lines is its own matter.
pub type Sink = Arc<dyn Fn(Entry) + Send + Sync>;

/// Numbers lines and hands them over.
#[derive(Clone)]
#[doc(hidden)]
pub struct Journal {
    sink: Sink,
    next: Arc<AtomicU64>,
}

thread_local! {
    /// The line that what happens on this thread follows from.
    static CAUSE: Cell<u64> = const { Cell::new(0) };
}

impl Journal {
    pub(crate) fn new(sink: Sink) -> Self {
        // 0 is no line.
        Self { sink, next: Arc::new(AtomicU64::new(1)) }
    }

    /// Writes a line; its number.
    pub(crate) fn write(&self, time: MonotonicTime, event: Event) -> u64 {
        let number = self.next.fetch_add(1, Ordering::Relaxed);
        if !matches!(event, Event::Overrun { .. } | Event::Unsafe { .. } | Event::Message { .. }) {
            CAUSE.set(number);
        }
        (self.sink)(Entry { number, time, event });
        number
    }

    /// Writes that something could not be made safe.
    pub(crate) fn could_not_be_made_safe(&self, time: MonotonicTime, errors: Vec<SafetyError>) {
        self.write(time, Event::Unsafe { cause: CAUSE.get(), errors });
    }

    /// Writes that an estimator has overrun its budget.
    pub(crate) fn overrun(&self, time: MonotonicTime, estimator: usize) {
        self.write(time, Event::Overrun { cause: CAUSE.get(), estimator });
    }
}

impl fmt::Debug for Journal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Journal").finish_non_exhaustive()
    }
}
