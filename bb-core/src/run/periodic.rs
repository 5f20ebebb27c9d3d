//! What sensors, controllers and bridges have in common for the framework: each is wrapped once.

use super::{SensorDeclaration, Startup};
use crate::component::{Bridge, Controller, Fault, Options, Reading, Sensor, SensorContext, ServiceContext};
use crate::message::Payload;
use crate::time::MonotonicTime;

/// Something that is called at a rate and publishes what it gives.
pub trait Periodic: Sized + Send + 'static {
    /// Its options.
    type Options: Options;
    /// What it publishes.
    type Output: Payload;
    /// What it is told when it starts.
    type Context: Send;

    /// The context.
    fn context(declaration: &'static SensorDeclaration, startup: &Startup) -> Self::Context;
    /// See [`Sensor::init`].
    fn init(options: Self::Options, context: &Self::Context) -> Result<Self, Fault>;
    /// See [`Sensor::read`].
    fn read(&mut self, now: MonotonicTime) -> Result<Reading<Self::Output>, Fault>;
    /// See [`Sensor::starts_at`].
    fn starts_at(&self) -> Option<MonotonicTime> {
        None
    }
    /// See [`Sensor::handle_options`].
    fn handle_options(&mut self, options: Self::Options, context: &Self::Context) -> Result<(), Fault>;
    /// See [`Sensor::terminate`].
    fn terminate(&mut self);
}

/// A sensor.
#[derive(Debug)]
pub struct AsSensor<S>(S);

impl<S: Sensor> Periodic for AsSensor<S> {
    type Options = S::Options;
    type Output = S::Output;
    type Context = SensorContext;

    fn context(declaration: &'static SensorDeclaration, startup: &Startup) -> SensorContext {
        SensorContext {
            robot: startup.robot(),
            declaration,
            clock: startup.clock.clone(),
            stop: startup.stop.clone(),
            control: startup.control.clone(),
        }
    }

    fn init(options: S::Options, context: &SensorContext) -> Result<Self, Fault> {
        S::init(options, context).map(Self)
    }

    fn read(&mut self, now: MonotonicTime) -> Result<Reading<S::Output>, Fault> {
        self.0.read(now)
    }

    fn starts_at(&self) -> Option<MonotonicTime> {
        self.0.starts_at()
    }

    fn handle_options(&mut self, options: S::Options, context: &SensorContext) -> Result<(), Fault> {
        self.0.handle_options(options, context)
    }

    fn terminate(&mut self) {
        self.0.terminate();
    }
}

macro_rules! service {
    ($(#[$doc:meta])* $wrapper:ident, $service:ident) => {
        $(#[$doc])*
        #[derive(Debug)]
        pub struct $wrapper<S>(S);

        impl<S: $service> Periodic for $wrapper<S> {
            type Options = S::Options;
            type Output = S::Output;
            type Context = ServiceContext;

            fn context(declaration: &'static SensorDeclaration, startup: &Startup) -> ServiceContext {
                ServiceContext {
                    robot: startup.robot(),
                    declaration,
                    clock: startup.clock.clone(),
                    stop: startup.stop.clone(),
                    bus: startup.bus(),
                }
            }

            fn init(options: S::Options, context: &ServiceContext) -> Result<Self, Fault> {
                S::init(options, context).map(Self)
            }

            fn read(&mut self, now: MonotonicTime) -> Result<Reading<S::Output>, Fault> {
                self.0.update(now)
            }

            fn handle_options(&mut self, options: S::Options, context: &ServiceContext) -> Result<(), Fault> {
                self.0.handle_options(options, context)
            }

            fn terminate(&mut self) {
                self.0.terminate();
            }
        }
    };
}

service! {
    /// A controller.
    AsController, Controller
}

service! {
    /// A bridge.
    AsBridge, Bridge
}
