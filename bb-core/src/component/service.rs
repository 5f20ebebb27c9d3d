//! The contract of controllers and bridges, which run beside the dataflow of sensors and estimators.

use super::{Fault, Options, Reading, ServiceContext, Termination};
use crate::message::Payload;
use crate::time::MonotonicTime;

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
    /// Why it cannot start. At the start of the robot, the robot then does not start.
    fn init(options: Self::Options, context: &ServiceContext) -> Result<Self, Fault>;

    /// Performs its work once: at the declared `rate`, or repeatedly without one, so it may wait for its device or peer. It must then
    /// return from time to time, so that the robot can stop.
    ///
    /// # Errors
    /// Why it cannot go on; the fault is reported, and the service is restarted with fresh state.
    fn update(&mut self, now: MonotonicTime) -> Result<Reading<Self::Output>, Fault>;

    /// Takes new options, validated, after a parameter that they are bound to has changed. The default restarts the service
    /// with them: it is terminated and dropped before the new one is made.
    ///
    /// # Errors
    /// As for `update`.
    fn handle_options(&mut self, options: Self::Options, context: &ServiceContext) -> Result<(), Fault> {
        let _ = (options, context);
        Err(Fault::remake())
    }

    /// Cleans up before it stops or is restarted; not called after a panic.
    fn terminate(&mut self, reason: Termination<'_>) {
        let _ = reason;
    }
}
