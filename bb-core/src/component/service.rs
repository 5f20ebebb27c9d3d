//! The contract of controllers and bridges, which run beside the dataflow of sensors and estimators.

use super::{Fault, Options, Reading, ServiceContext, Termination};
use crate::message::Payload;
use crate::time::MonotonicTime;
use std::thread;
use std::time::{Duration, Instant};

/// Time for which [`StateReport::update`] waits without a rate.
const WAIT: Duration = Duration::from_millis(100);
/// Shortest time between two reports of a service without a rate.
const REPORT_PERIOD: Duration = Duration::from_secs(1);

/// A controller or a bridge: it runs beside the dataflow and reaches everything by path, through [`ServiceContext::bus`].
///
/// A controller drives actuators from published messages of sensors and estimators; a bridge connects the robot to a
/// dashboard, a middleware or a radio. They differ only in the keyword that declares them, and so in their path.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a service",
    label = "cannot be declared as a controller or a bridge",
    note = "implement `bb_core::Service` for it"
)]
pub trait Service: Sized + Send + 'static {
    /// Options of the service: the struct that `Name(…)` in `robot!` fills.
    type Options: Options;
    /// The payload it publishes at its path: its state, or a diagnosis.
    type Output: Payload;

    /// Creates it, at the start and at every restart.
    ///
    /// # Errors
    /// The reason for which it cannot start. At its start, the robot then does not start either.
    fn init(options: Self::Options, context: &ServiceContext) -> Result<Self, Fault>;

    /// Performs its work once: at the declared `rate`, or repeatedly without one, so it may wait for its device or peer. It must then
    /// return from time to time, so that the robot can stop.
    ///
    /// # Errors
    /// The reason for which it cannot go on; the fault is reported, and the service is restarted with fresh state.
    fn update(&mut self, now: MonotonicTime) -> Result<Reading<Self::Output>, Fault>;

    /// Applies new, validated options after a parameter that they are bound to has changed. The default restarts the service
    /// with them: it is terminated and dropped before the new one is created.
    ///
    /// # Errors
    /// As for `update`.
    fn handle_options(&mut self, options: Self::Options, context: &ServiceContext) -> Result<(), Fault> {
        let _ = (options, context);
        Err(Fault::remake())
    }

    /// Cleans up before the service stops or is restarted; not called after a panic.
    fn terminate(&mut self, reason: Termination<'_>) {
        let _ = reason;
    }
}

/// Reports the state of a bridge that works on its own threads: when it has changed, and at most once a second without a `rate`.
///
/// ```
/// use bb_core::component::StateReport;
/// use bb_core::prelude::*;
///
/// let mut report = StateReport::default();
/// assert_eq!(report.update(3.0), Reading::now(3.0));
/// assert_eq!(report.update(3.0), Reading::nothing());
/// ```
#[derive(Clone, Copy, Debug)]
pub struct StateReport<T> {
    last: Option<T>,
    next: Option<Instant>,
    /// `true` if the service has a rate or runs on virtual time, and so must not wait.
    is_paced: bool,
}

impl<T> Default for StateReport<T> {
    fn default() -> Self {
        Self { last: None, next: None, is_paced: false }
    }
}

impl<T: Clone + PartialEq> StateReport<T> {
    /// Creates the report of a service.
    pub fn new(context: &ServiceContext) -> Self {
        Self { is_paced: context.period_s().is_some() || context.clock().is_virtual(), ..Self::default() }
    }

    /// The reading of an update with this state: `state` if it has changed. Otherwise, without a rate, it waits for a tenth of a second.
    pub fn update(&mut self, state: T) -> Reading<T> {
        let is_due = self.is_paced || self.next.is_none_or(|next| Instant::now() >= next);
        if is_due && self.last.as_ref() != Some(&state) {
            self.next = Some(Instant::now() + REPORT_PERIOD);
            self.last = Some(state.clone());
            return Reading::now(state);
        }
        if !self.is_paced {
            thread::sleep(WAIT);
        }
        Reading::nothing()
    }
}
