//! The common interface of all components, whatever trait they implement.

use super::stand_in::{AnySensor, StandIn, make_actuator, make_sensor};
use crate::component::{
    Actuator, ActuatorContext, Context, Estimator, Options, Reading, Sensor, SensorContext, Service, ServiceContext,
};
use crate::declaration::SensorDeclaration;
use crate::fault::Fault;
use crate::message::{Payload, Stamped};
use crate::time::MonotonicTime;
use std::fmt;

/// A component as seen by its `Slot`.
pub trait Component: Sized + Send + 'static {
    /// Its options.
    type Options: Options;
    /// The context for its start.
    type Context: Send;

    /// Creates it.
    ///
    /// # Errors
    /// Why it cannot start.
    fn make(options: Self::Options, context: &Self::Context) -> Result<Self, Fault>;
    /// Takes new options.
    ///
    /// # Errors
    /// Why it cannot go on.
    fn change(&mut self, options: Self::Options, context: &Self::Context) -> Result<(), Fault>;
    /// Closes it.
    fn close(&mut self);
}

/// A component that is called at a rate and publishes its readings: a sensor or a service.
pub trait Periodic: Component {
    /// What it publishes.
    type Output: Payload;

    /// Its context.
    #[doc(hidden)]
    fn context(declaration: &'static SensorDeclaration, host: HostHandle) -> Self::Context;
    /// Takes one reading.
    ///
    /// # Errors
    /// Why it cannot be taken.
    fn read(&mut self, now: MonotonicTime) -> Result<Reading<Self::Output>, Fault>;
    /// When it wants to be read first.
    fn starts_at(&self) -> Option<MonotonicTime>;
}

/// The robot, for contexts.
#[derive(Clone, Debug)]
pub struct HostHandle(pub(crate) std::sync::Arc<dyn crate::component::Host>);

macro_rules! component {
    ($(#[$doc:meta])* $visibility:vis $wrapper:ident: $contract:ident, $context:ty) => {
        $(#[$doc])*
        #[derive(Debug)]
        $visibility struct $wrapper<C>(pub(crate) C);

        impl<C: $contract> Component for $wrapper<C> {
            type Options = C::Options;
            type Context = $context;

            fn make(options: C::Options, context: &$context) -> Result<Self, Fault> {
                C::init(options, context).map(Self)
            }

            fn change(&mut self, options: C::Options, context: &$context) -> Result<(), Fault> {
                self.0.handle_options(options, context)
            }

            fn close(&mut self) {
                self.0.terminate();
            }
        }
    };
}

component! {
    /// An estimator.
    pub(crate) AsEstimator: Estimator, Context
}

/// A sensor, or its replacement.
#[doc(hidden)]
pub enum AsSensor<S: Sensor> {
    /// As declared.
    Declared(S),
    /// A replacement.
    Replaced(StandInSensor<S::Output>),
}

/// The replacement of a sensor.
#[doc(hidden)]
pub struct StandInSensor<T>(Box<dyn AnySensor<T>>);

impl<S: Sensor> fmt::Debug for AsSensor<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("AsSensor").finish_non_exhaustive()
    }
}

impl<T> fmt::Debug for StandInSensor<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("StandInSensor").finish_non_exhaustive()
    }
}

impl<S: Sensor> Component for AsSensor<S> {
    type Options = S::Options;
    type Context = SensorContext;

    fn make(options: S::Options, context: &SensorContext) -> Result<Self, Fault> {
        match context.replacement() {
            Some(replacement) => make_sensor(&replacement, context).map(|made| Self::Replaced(StandInSensor(made))),
            None => S::init(options, context).map(Self::Declared),
        }
    }

    fn change(&mut self, options: S::Options, context: &SensorContext) -> Result<(), Fault> {
        match self {
            Self::Declared(sensor) => sensor.handle_options(options, context),
            // The options belong to the replaced component.
            Self::Replaced(_) => Ok(()),
        }
    }

    fn close(&mut self) {
        match self {
            Self::Declared(sensor) => sensor.terminate(),
            Self::Replaced(StandInSensor(sensor)) => sensor.terminate(),
        }
    }
}

component! {
    /// A controller or a bridge.
    pub AsService: Service, ServiceContext
}

/// An actuator, or its replacement.
pub(crate) enum AsActuator<A: Actuator> {
    Declared(A),
    Replaced(Box<dyn StandIn<A::Command>>),
}

/// Calls the actuator, whichever it is.
macro_rules! whichever {
    ($self:expr, $actuator:ident => $call:expr, $replaced:ident => $other:expr) => {
        match $self {
            Self::Declared($actuator) => $call,
            Self::Replaced($replaced) => $other,
        }
    };
}

impl<A: Actuator> AsActuator<A> {
    pub(crate) fn handle_command(&mut self, command: &Stamped<A::Command>) -> Result<(), Fault> {
        whichever!(self, own => own.handle_command(command), other => other.handle_command(command))
    }

    pub(crate) fn next_update(&self) -> Option<MonotonicTime> {
        whichever!(self, own => own.next_update(), other => other.next_update())
    }

    pub(crate) fn update(&mut self, now: MonotonicTime) -> Result<(), Fault> {
        whichever!(self, own => own.update(now), other => other.update(now))
    }

    pub(crate) fn disarm(&mut self) -> Result<(), Fault> {
        whichever!(self, own => own.disarm(), other => other.disarm())
    }
}

impl<A: Actuator> Component for AsActuator<A> {
    type Options = A::Options;
    type Context = ActuatorContext;

    fn make(options: A::Options, context: &ActuatorContext) -> Result<Self, Fault> {
        match context.replacement() {
            Some(replacement) => make_actuator(&replacement, context).map(Self::Replaced),
            None => A::init(options, context).map(Self::Declared),
        }
    }

    fn change(&mut self, options: A::Options, context: &ActuatorContext) -> Result<(), Fault> {
        match self {
            Self::Declared(actuator) => actuator.handle_options(options, context),
            // The options belong to the replaced component.
            Self::Replaced(_) => Ok(()),
        }
    }

    fn close(&mut self) {
        whichever!(self, own => own.terminate(), other => other.terminate());
    }
}

impl<S: Sensor> Periodic for AsSensor<S> {
    type Output = S::Output;

    fn context(declaration: &'static SensorDeclaration, host: HostHandle) -> SensorContext {
        SensorContext::new(declaration, host.0)
    }

    fn read(&mut self, now: MonotonicTime) -> Result<Reading<S::Output>, Fault> {
        match self {
            Self::Declared(sensor) => sensor.read(now),
            Self::Replaced(StandInSensor(sensor)) => sensor.read(now),
        }
    }

    fn starts_at(&self) -> Option<MonotonicTime> {
        match self {
            Self::Declared(sensor) => sensor.starts_at(),
            Self::Replaced(StandInSensor(sensor)) => sensor.starts_at(),
        }
    }
}

impl<S: Service> Periodic for AsService<S> {
    type Output = S::Output;

    fn context(declaration: &'static SensorDeclaration, host: HostHandle) -> ServiceContext {
        ServiceContext::new(declaration, host.0)
    }

    fn read(&mut self, now: MonotonicTime) -> Result<Reading<S::Output>, Fault> {
        self.0.update(now)
    }

    fn starts_at(&self) -> Option<MonotonicTime> {
        None
    }
}
