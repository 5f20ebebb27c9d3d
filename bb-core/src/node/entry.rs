//! Entries for one estimator other than messages, and the estimator's reports.

use crate::declaration::ParameterValues;
use crate::event::HealthTransition;
use crate::journal::{Event, Request};
use crate::time::MonotonicTime;
use std::any::Any;
use std::fmt;

/// An entry for one estimator of an island.
pub enum NodeEntry {
    /// The estimator starts: timers requested in `init` run from now.
    Start,
    /// New parameter values.
    Options(ParameterValues),
    /// A restart requested by a supervisor.
    Restart,
    /// The supervisor gives up the estimator.
    GiveUp,
    /// The estimator is lost.
    Silence {
        /// Number of times that the estimator has been lost, this time included.
        epoch: u32,
        /// Time at which the last run was completed, as the watchdog saw it.
        last_run: MonotonicTime,
    },
    /// A one-way request: a `Cast<E>`.
    Cast {
        /// The request.
        request: Request,
        /// Handles the request. `None` in a replay of a journal that does not contain the request.
        handle: Option<Box<dyn Any + Send>>,
    },
    /// The estimator stops.
    Retire,
}

impl NodeEntry {
    /// The entry's line in a journal.
    pub(super) fn line(&self, estimator: usize, island: usize) -> Event {
        match self {
            Self::Start => Event::Start { island },
            Self::Options(values) => Event::Options { estimator, values: values.all().to_vec() },
            Self::Restart => Event::Restart { estimator },
            Self::GiveUp => Event::GiveUp { estimator },
            Self::Silence { epoch, last_run } => Event::Silence { estimator, epoch: *epoch, last_run: *last_run },
            Self::Cast { request, .. } => Event::Request { estimator, request: request.clone() },
            Self::Retire => Event::Retire { island },
        }
    }
}

impl fmt::Debug for NodeEntry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Start => "Start",
            Self::Options(_) => "Options",
            Self::Restart => "Restart",
            Self::GiveUp => "GiveUp",
            Self::Silence { .. } => "Silence",
            Self::Cast { .. } => "Cast",
            Self::Retire => "Retire",
        })
    }
}

/// A report of an estimator to the robot's control state.
#[derive(Clone, Debug)]
pub(crate) enum Report {
    /// The health has changed.
    Health(HealthReport),
    /// The estimator has failed.
    Failed {
        /// Message of the fault.
        message: String,
        /// `true` if the estimator panicked, which counts against its supervisor's budget.
        panicked: bool,
    },
}

/// A change of health.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HealthReport {
    pub(crate) transition: HealthTransition,
    /// Number of losses that the estimator knew of. A report from before the last loss is out of date.
    pub(crate) epoch: u32,
}
