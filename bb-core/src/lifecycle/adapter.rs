//! The common interface of all components, whatever trait they implement.

use super::stand_in::{AnyEstimator, AnySensor, StandIn, make_actuator, make_estimator, make_sensor};
use crate::component::{
    Actuator, ActuatorContext, Context, Estimator, Info, InputTransforms, Inputs, Options, Reading, Reply, Sensor,
    SensorContext,
};
use crate::fault::{Fault, Termination};
use crate::message::Stamped;
use crate::time::MonotonicTime;

/// A component as seen by its `Slot`.
pub(crate) trait Component: Sized + Send + 'static {
    /// Options of the component.
    type Options: Options;
    /// The context for its start.
    type Context: Send;

    /// Creates it. Its options are not asked for if it is replaced.
    ///
    /// # Errors
    /// Why it cannot start.
    fn make(options: impl FnOnce() -> Result<Self::Options, Fault>, context: &Self::Context)
    -> Result<Self, Fault>;
    /// Takes new options.
    ///
    /// # Errors
    /// Why it cannot go on.
    fn change(
        &mut self,
        options: impl FnOnce() -> Result<Self::Options, Fault>,
        context: &Self::Context,
    ) -> Result<(), Fault>;
    /// Closes it.
    fn close(&mut self, reason: Termination<'_>);
}

/// Calls the component, whichever it is.
macro_rules! whichever {
    ($self:expr, $declared:ident => $call:expr, $replaced:ident => $other:expr) => {
        match $self {
            Self::Declared($declared) => $call,
            Self::Replaced($replaced) => $other,
        }
    };
}

/// An estimator, or its replacement.
pub(crate) enum AsEstimator<E: Estimator> {
    Declared(E),
    Replaced(Box<dyn AnyEstimator<E::Input, E::Output>>),
}

impl<E: Estimator> AsEstimator<E> {
    /// The declared one: only it handles requests.
    pub(crate) fn declared(&mut self) -> Option<&mut E> {
        match self {
            Self::Declared(estimator) => Some(estimator),
            Self::Replaced(_) => None,
        }
    }

    /// Hands the reply to `take` in each case by itself: joined to one value first, it would be copied, which costs more than the rest of
    /// a hop.
    #[inline]
    pub(crate) fn handle_input<T>(
        &mut self,
        input: <E::Input as Inputs>::View<'_>,
        take: impl FnOnce(Reply<E::Output>) -> T,
    ) -> Result<T, Fault> {
        whichever!(self, own => own.handle_input(input).map(take), other => other.handle_input(input).map(take))
    }

    pub(crate) fn handle_transforms(&mut self, transforms: &InputTransforms<'_>) -> Result<(), Fault> {
        whichever!(self, own => own.handle_transforms(transforms), other => other.handle_transforms(transforms))
    }

    pub(crate) fn handle_info(&mut self, info: Info) -> Result<Reply<E::Output>, Fault> {
        whichever!(self, own => own.handle_info(info), other => other.handle_info(info))
    }

    pub(crate) fn handle_continue(&mut self, step: u32) -> Result<Reply<E::Output>, Fault> {
        whichever!(self, own => own.handle_continue(step), other => other.handle_continue(step))
    }

    pub(crate) fn handle_end(&mut self) -> Option<E::Output> {
        whichever!(self, own => own.handle_end(), other => other.handle_end())
    }
}

/// A sensor, or its replacement.
pub(crate) enum AsSensor<S: Sensor> {
    Declared(S),
    Replaced(Box<dyn AnySensor<S::Output>>),
}

impl<S: Sensor> AsSensor<S> {
    pub(crate) fn read(&mut self, now: MonotonicTime) -> Result<Reading<S::Output>, Fault> {
        whichever!(self, own => own.read(now), other => other.read(now))
    }

    pub(crate) fn starts_at(&self) -> Option<MonotonicTime> {
        whichever!(self, own => own.starts_at(), other => other.starts_at())
    }
}

/// An actuator, or its replacement.
pub(crate) enum AsActuator<A: Actuator> {
    Declared(A),
    Replaced(Box<dyn StandIn<A::Command>>),
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

macro_rules! component {
    ($($wrapper:ident of $contract:ident, made by $make:ident in $context:ty;)*) => { $(
        impl<C: $contract> Component for $wrapper<C> {
            type Options = C::Options;
            type Context = $context;

            fn make(options: impl FnOnce() -> Result<C::Options, Fault>, context: &$context) -> Result<Self, Fault> {
                match context.replacement() {
                    Some(replacement) => $make(&replacement, context).map(Self::Replaced),
                    None => C::init(options()?, context).map(Self::Declared),
                }
            }

            fn change(
                &mut self,
                options: impl FnOnce() -> Result<C::Options, Fault>,
                context: &$context,
            ) -> Result<(), Fault> {
                match self {
                    Self::Declared(component) => component.handle_options(options()?, context),
                    // The options belong to the replaced component.
                    Self::Replaced(_) => Ok(()),
                }
            }

            fn close(&mut self, reason: Termination<'_>) {
                whichever!(self, own => own.terminate(reason), other => other.terminate(reason));
            }
        }
    )* };
}

component! {
    AsEstimator of Estimator, made by make_estimator in Context;
    AsSensor of Sensor, made by make_sensor in SensorContext;
    AsActuator of Actuator, made by make_actuator in ActuatorContext;
}
