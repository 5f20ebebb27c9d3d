//! The contract of controllers and bridges: what runs beside the dataflow of sensors and estimators.

use super::{Fault, Options, Reading, ServiceContext};
use crate::Payload;
use crate::time::MonotonicTime;

/// A controller or a bridge: it runs beside the dataflow and reaches everything by path, through [`ServiceContext::bus`].
///
/// A controller drives actuators from what sensors and estimators publish; a bridge connects the robot to a dashboard, a
/// middleware or a radio. They differ only in the word they are declared with, and so in their path.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a service",
    label = "cannot be declared as a controller or a bridge",
    note = "implement `bb_core::Service` for it"
)]
pub trait Service: Sized + Send + 'static {
    /// Its options: the struct that `Name(…)` in `robot!` fills.
    type Options: Options;
    /// What it publishes at its path: its state, a diagnosis.
    type Output: Payload;

    /// Makes it, at the start and at every restart.
    ///
    /// # Errors
    /// Why it cannot start: at the start, the robot then does not start.
    fn init(options: Self::Options, context: &ServiceContext) -> Result<Self, Fault>;

    /// Does its work once: at the declared `rate`, or again and again where none is declared, so that it may wait for what
    /// it needs; it must then return now and then, so that the robot can stop.
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
    fn terminate(&mut self) {}
}
