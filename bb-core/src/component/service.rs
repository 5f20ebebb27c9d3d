//! The contracts of controllers and bridges: what runs beside the dataflow of sensors and estimators.

use super::{Fault, Options, Reading};
use crate::Payload;
use crate::run::{Bus, SensorDeclaration, StopSignal};
use crate::time::{Clock, MonotonicTime};

/// What a controller or a bridge is told when it starts.
#[derive(Clone, Debug)]
pub struct ServiceContext {
    pub(crate) robot: &'static str,
    pub(crate) declaration: &'static SensorDeclaration,
    pub(crate) clock: Clock,
    pub(crate) stop: StopSignal,
    pub(crate) bus: Bus,
}

impl ServiceContext {
    /// The robot's name.
    pub fn robot(&self) -> &'static str {
        self.robot
    }

    /// Its path: `controller/stability`.
    pub fn path(&self) -> &'static str {
        self.declaration.path
    }

    /// The declared period in seconds, if it has a `rate`.
    pub fn period_s(&self) -> Option<f64> {
        self.declaration.period_nanos.map(|nanos| nanos as f64 * 1e-9)
    }

    /// The clock of the run.
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// Topics, actuators, parameters and commands, by path.
    pub fn bus(&self) -> &Bus {
        &self.bus
    }

    /// Whether the robot has been told to stop.
    pub fn is_stopping(&self) -> bool {
        self.stop.is_set()
    }
}

macro_rules! service {
    ($(#[$doc:meta])* $service:ident) => {
        $(#[$doc])*
        pub trait $service: Sized + Send + 'static {
            /// What `Name(…)` in `robot!` fills.
            type Options: Options;
            /// What it publishes at its path: its state, a diagnosis.
            type Output: Payload;

            /// Makes it, at the start and at every restart. Topics, actuators and the rest are in [`ServiceContext::bus`].
            ///
            /// # Errors
            /// What keeps it from starting: at the start, the robot then does not start.
            fn init(options: Self::Options, context: &ServiceContext) -> Result<Self, Fault>;

            /// Does its work once: at the declared `rate`, or again and again where none is declared, so that it may wait
            /// for what it needs; then it comes back now and then, so that the robot can stop.
            ///
            /// # Errors
            /// What keeps it from going on; the fault is reported, and it is started anew from a clean state.
            fn update(&mut self, now: MonotonicTime) -> Result<Reading<Self::Output>, Fault>;

            /// Takes new options, validated, after a parameter that they are bound to has changed. Unless it is written,
            /// it is made anew with them.
            ///
            /// # Errors
            /// As for `update`.
            fn handle_options(&mut self, options: Self::Options, context: &ServiceContext) -> Result<(), Fault> {
                *self = Self::init(options, context)?;
                Ok(())
            }

            /// Cleans up, before it stops or is started anew; not after a panic.
            fn terminate(&mut self) {}
        }
    };
}

service! {
    /// Drives actuators from what sensors and estimators publish. Motion planning and kinematics are later work of this
    /// framework; what is here runs a controller, and lets it reach everything.
    #[diagnostic::on_unimplemented(
        message = "`{Self}` is not a controller",
        label = "cannot be declared with `controller`",
        note = "implement `bb_core::Controller` for it"
    )]
    Controller
}

service! {
    /// Connects the robot to something else: a dashboard, a middleware, a radio.
    #[diagnostic::on_unimplemented(
        message = "`{Self}` is not a bridge",
        label = "cannot be declared with `bridge`",
        note = "implement `bb_core::Bridge` for it"
    )]
    Bridge
}
