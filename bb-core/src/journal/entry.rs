//! The lines of a journal.

use crate::event::{HardwareError, ParameterValue, SafetyError};
use crate::joints::PlacedInput;
use crate::message::Payload;
use crate::message::codec::{Reader, Shape, Writer};
use crate::message::{DecodeError, Field, Finite};
use crate::pubsub::DynamicMessage;
use crate::time::MonotonicTime;
use std::sync::Arc;

/// One line of a journal. It is a payload: [`Builder::publish_journal`](crate::Builder::publish_journal) publishes
/// lines at `journal`.
#[derive(Clone, Debug, Payload)]
pub struct JournalLine {
    /// Number of the line, from 1, without gaps.
    pub number: u64,
    /// The time of the robot's clock.
    pub time: MonotonicTime,
    /// Event that was processed.
    pub event: Event,
}

impl JournalLine {
    /// Wall time minus monotonic time from this line on, in nanoseconds, if the line states it: the first line does, and each one at
    /// which the machine's date was set.
    pub fn wall_offset_nanos(&self) -> Option<i64> {
        match self.event {
            Event::Begin { wall_offset_nanos, .. } => Some(wall_offset_nanos),
            Event::WallClock { offset_nanos } => Some(offset_nanos),
            _ => None,
        }
    }
}

/// Another name of [`JournalLine`], for code that handles many of them.
pub type Entry = JournalLine;

/// Event of a line. Islands, estimators, publishers, actuators, commands and parameters are named by their numbers.
#[derive(Clone, Debug, Payload)]
#[non_exhaustive]
pub enum Event {
    /// The journal begins.
    Begin {
        /// The robot and its settings, one fact per line.
        declaration: Vec<String>,
        /// Wall time minus monotonic time, in nanoseconds. With the line's time, it gives the date at which the run began.
        wall_offset_nanos: i64,
        /// `true` if the run was on virtual time.
        is_virtual: bool,
    },
    /// The wall clock was set; the next line is the first to see it.
    WallClock {
        /// Wall time minus monotonic time, in nanoseconds.
        offset_nanos: i64,
    },
    /// A sensor or a service published a message, or other code did for it.
    Message {
        /// The publisher.
        publisher: usize,
        /// The message.
        message: Recorded,
    },
    /// A command, a service or other code published at a path of its choice.
    Own {
        /// The path.
        path: &'static str,
        /// The message.
        message: Recorded,
    },
    /// An actuator carried out a command.
    Actuated {
        /// The actuator.
        actuator: usize,
        /// The command.
        message: Recorded,
    },
    /// An island received a message.
    Deliver {
        /// The island.
        island: usize,
        /// The publisher, as numbered by the island.
        entry: usize,
        /// The number of the message's line; 0 for a message published by another island.
        message: u64,
    },
    /// A message did not fit in the inbox of an island.
    Drop {
        /// The island.
        island: usize,
        /// The publisher, as in [`Event::Deliver`].
        entry: usize,
        /// The message, as in [`Event::Deliver`].
        message: u64,
    },
    /// The estimators of an island started.
    Start {
        /// The island.
        island: usize,
    },
    /// An island did the work that was due.
    Wake {
        /// The island.
        island: usize,
    },
    /// An estimator was given new parameters for its options.
    Options {
        /// The estimator.
        estimator: usize,
        /// The values of all parameters.
        values: Vec<ParameterValue>,
    },
    /// An estimator was restarted by its supervisor.
    Restart {
        /// The estimator.
        estimator: usize,
    },
    /// An estimator was given up by its supervisor.
    GiveUp {
        /// The estimator.
        estimator: usize,
    },
    /// An estimator was told that it is lost.
    Silence {
        /// The estimator.
        estimator: usize,
        /// Number of times that the estimator has been lost, this time included.
        epoch: u32,
        /// Time at which a run on a message of its driver had last been completed.
        last_run: MonotonicTime,
    },
    /// An estimator handled a request.
    Request {
        /// The estimator.
        estimator: usize,
        /// The request.
        request: Request,
    },
    /// The estimators of an island stopped.
    Retire {
        /// The island.
        island: usize,
    },
    /// The durations of a line's measured callbacks.
    Measured {
        /// The number of that line.
        cause: u64,
        /// Durations, in order.
        callbacks: Vec<Callback>,
    },
    /// An estimator emitted a message.
    Output {
        /// Island of the estimator.
        island: usize,
        /// The publisher.
        publisher: usize,
        /// Checksum of the message.
        checksum: u64,
    },
    /// An estimator emitted a message in reply to a request that the journal does not hold.
    Emission {
        /// The publisher.
        publisher: usize,
        /// `true` for the first message of the callback: the outputs of one callback count once.
        is_first: bool,
        /// The message.
        message: Recorded,
    },
    /// A change of health, a fault or a panic reported by an estimator was processed.
    Report {
        /// The estimator.
        estimator: usize,
    },
    /// No run on a message of its driver had been completed for too long: the estimator is lost.
    Lost {
        /// The estimator.
        estimator: usize,
        /// Time at which one had last been completed.
        last_run: MonotonicTime,
    },
    /// A sensor, a service or an actuator failed.
    Failed {
        /// Path of the component.
        path: &'static str,
        /// Supervisor of the component.
        supervisor: usize,
        /// Message of the fault.
        message: String,
        /// `true` if the component panicked.
        panicked: bool,
    },
    /// A component hangs or did not stop properly, or something other than a component failed. It had no other
    /// consequence.
    Noted {
        /// Path of the component.
        path: &'static str,
        /// Message of the fault.
        message: String,
    },
    /// Hardware was reported to be in a dangerous state.
    HardwareError {
        /// Path of the component that reported it.
        path: &'static str,
        /// Error of the hardware.
        error: HardwareError,
    },
    /// Parameters were set, all at once.
    Parameters {
        /// Changed parameters with their new values.
        changes: Vec<ParameterEntry>,
        /// Caller that has set them.
        caller: String,
    },
    /// A command was requested.
    Command {
        /// The command.
        command: usize,
        /// Caller that asked for it.
        caller: String,
    },
    /// The code of a command has ended.
    Ended {
        /// The number of the execution.
        execution: u64,
        /// End of the code.
        end: End,
    },
    /// A command was cancelled by its caller.
    Cancel {
        /// The number of the execution.
        execution: u64,
    },
    /// A command took longer than its `timeout`.
    Timeout {
        /// The number of the execution.
        execution: u64,
    },
    /// The code of a command that was cancelled, or took too long, has returned.
    Gone {
        /// The number of the execution.
        execution: u64,
    },
    /// The robot was armed.
    Arm {
        /// Caller that armed it.
        caller: String,
    },
    /// The robot was disarmed.
    Disarm {
        /// `true` if the disarming was forced.
        force: bool,
        /// Caller that disarmed it.
        caller: String,
    },
    /// The disarm callbacks have returned, or their time limit has passed.
    Disarmed {
        /// Errors of the hardware that could not be made safe.
        errors: Vec<SafetyError>,
    },
    /// Arming gave up waiting for cancelled commands.
    ArmTimeout,
    /// The robot was stopped.
    Stop {
        /// Caller that stopped it.
        caller: String,
    },
    /// The transforms of a line's inputs that span moving joints.
    Placed {
        /// The number of that line.
        cause: u64,
        /// Transforms, in order.
        inputs: Vec<PlacedInput>,
    },
    /// A command changed the operational state while it ran.
    Transition {
        /// The number of the execution.
        execution: u64,
        /// The new state.
        state: String,
    },
    /// A command, a service or other code may publish at a path of its choice.
    OwnPublisher {
        /// The path.
        path: &'static str,
        /// The name of the payload's type.
        payload: &'static str,
    },
    /// A caller publishes the messages that follow at a path: one of its choice, or that of a sensor whose messages other code
    /// publishes. Messages published through a handle of the program's robot are its own and have no such line.
    Publisher {
        /// The path.
        path: &'static str,
        /// Name of the caller, as in [`CommandEvent`](crate::event::CommandEvent).
        caller: String,
    },
}

/// A new value of a parameter.
#[derive(Clone, Debug, PartialEq, Payload)]
pub struct ParameterEntry {
    /// The parameter, by its number.
    pub parameter: usize,
    /// New value.
    pub value: ParameterValue,
}

/// The duration of a callback.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Payload)]
pub struct Callback {
    /// The estimator.
    pub estimator: usize,
    /// Nanoseconds.
    pub nanos: i64,
}

/// The end of a command's code.
#[derive(Clone, Debug, PartialEq, Eq, Payload)]
pub enum End {
    /// The code succeeded, and may have named the next state.
    Succeeded {
        /// Next state, if one was named.
        next_state: Option<String>,
    },
    /// The code failed.
    Failed {
        /// Reason for the failure.
        message: String,
    },
}

/// A request to an estimator.
#[derive(Clone, Debug, PartialEq, Eq, Payload)]
pub struct Request {
    /// Kind of the request: whether a caller waits for the answer.
    pub kind: RequestKind,
    /// The name of its type.
    pub name: String,
    /// The request itself, if its type defines how it is recorded.
    pub bytes: Option<Vec<u8>>,
}

/// The kind of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Payload)]
pub enum RequestKind {
    /// A request with an answer: `HandleCall`.
    Call,
    /// A one-way request: `HandleCast`.
    Cast,
}

/// A message in a journal: the value itself, or bytes read from a file.
#[derive(Clone, Debug)]
pub enum Recorded {
    /// The message as it was published.
    Message(DynamicMessage),
    /// Bytes of the message.
    Bytes(Arc<[u8]>),
}

impl Finite for Recorded {
    /// A journal holds every message, NaN included.
    fn is_finite(&self) -> bool {
        true
    }
}

impl Field for Recorded {
    const SHAPE: Shape = <Vec<u8> as Field>::SHAPE;

    fn heap_bytes(&self) -> usize {
        match self {
            Self::Message(message) => message.bytes(),
            Self::Bytes(bytes) => bytes.len(),
        }
    }

    fn write(&self, writer: &mut Writer<'_>) {
        match self {
            Self::Message(message) => {
                let mut bytes = Vec::new();
                message.encode(&mut bytes);
                bytes.write(writer);
            }
            Self::Bytes(bytes) => bytes.to_vec().write(writer),
        }
    }

    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        Ok(Self::Bytes(Vec::<u8>::read(reader)?.into()))
    }
}
