//! Typed names of what a robot declares; `robot!` generates one per publisher, at its path.

use super::{ActuatorNode, Robot, Visitable};
use crate::component::options::{OptionsList, unverified};
use crate::component::{Actuator, Command, Estimator, Sensor, Service};
use crate::control::SystemTopics;
use crate::declaration::ParameterType;
use crate::event::{
    CommandEvent, ComponentFault, HealthTransition, ParameterChange, ParameterValue, SafetyError, SafetyTransition,
    StateTransition,
};
use crate::journal::JournalLine;
use crate::message::{Frame, Payload, Stamped};
use crate::pubsub::Topic;

use crate::time::MonotonicTime;
use std::fmt;
use std::marker::PhantomData;

/// A publisher that can be subscribed to: the handle of a sensor, of an estimator with one output, or of an output.
#[diagnostic::on_unimplemented(
    message = "`{Self}` cannot be subscribed to",
    label = "is no handle of a publisher",
    note = "name a publisher by its handle, as in `rover::sensor::base::imu`; a path that is known only at run time goes to \
            `subscribe_any(Select::Path(path), …)`",
    note = "an estimator of several outputs is subscribed to output by output"
)]
pub trait Publisher<R: Robot>: Copy {
    /// Payload of the messages.
    type Payload: Payload;
    /// Returns the path of the publisher.
    fn path(self) -> &'static str;
    /// Returns the topic of the publisher.
    #[doc(hidden)]
    fn topic<'a>(self, topics: &'a R::Topics, system: &'a SystemTopics) -> &'a Topic<Self::Payload>;
}

/// The topic of a publisher. The expansion numbers handles and topics alike. A robot that failed to verify has no
/// topics, and never runs.
fn topic<R: Robot, T: Payload>(topics: &R::Topics, publisher: usize) -> &Topic<T> {
    let topic = R::topic(topics, publisher).and_then(|topic| topic.as_any().downcast_ref());
    topic.unwrap_or_else(unverified)
}

type NodeOf<R, A> = fn(&<R as Robot>::Wiring) -> &ActuatorNode<A>;
type PublishOf<R, T> = fn(&<R as Robot>::Wiring, &Stamped<T>, MonotonicTime);

macro_rules! handle {
    ($(#[$doc:meta])* $name:ident<$($component:ident: $bound:path),+> { $($field:ident: $type:ty),* }) => {
        $(#[$doc])*
        pub struct $name<R: Robot, $($component: $bound),+> {
            path: &'static str,
            $(pub(super) $field: $type,)*
            of: PhantomData<fn() -> (R, $($component),+)>,
        }

        impl<R: Robot, $($component: $bound),+> $name<R, $($component),+> {
            #[doc(hidden)]
            pub const fn new(path: &'static str, $($field: $type),*) -> Self {
                Self { path, $($field,)* of: PhantomData }
            }

            /// Returns the path.
            pub const fn path(self) -> &'static str {
                self.path
            }
        }

        impl<R: Robot, $($component: $bound),+> Clone for $name<R, $($component),+> {
            fn clone(&self) -> Self {
                *self
            }
        }

        impl<R: Robot, $($component: $bound),+> Copy for $name<R, $($component),+> {}

        impl<R: Robot, $($component: $bound),+> fmt::Debug for $name<R, $($component),+> {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.debug_tuple(stringify!($name)).field(&self.path).finish()
            }
        }
    };
}

handle! {
    /// Names a sensor of the robot `R`.
    SensorHandle<S: Sensor> {
        publisher: usize,
        component: usize,
        frame: Frame,
        publish: PublishOf<R, S::Output>
    }
}

handle! {
    /// Names an estimator with one output, `T`, of the robot `R`.
    EstimatorHandle<E: Estimator, T: Payload> {
        number: usize,
        publisher: usize,
        component: usize
    }
}

handle! {
    /// Names an estimator with several outputs of the robot `R`; each has an [`OutputHandle`] below it.
    EstimatorOfSeveralHandle<E: Estimator> {
        number: usize,
        component: usize
    }
}

handle! {
    /// Names a controller of the robot `R`.
    ControllerHandle<S: Service> { publisher: usize, component: usize }
}

handle! {
    /// Names a bridge of the robot `R`.
    BridgeHandle<S: Service> { publisher: usize, component: usize }
}

handle! {
    /// Names an actuator of the robot `R`.
    ActuatorHandle<A: Actuator> { component: usize, node: NodeOf<R, A> }
}

handle! {
    /// Names a command of the robot `R`. Its progress is published at its path.
    CommandHandle<C: Command> { number: usize, component: usize }
}

handle! {
    /// Names a parameter of the robot `R`, of type `T`. Its changes are published at its path.
    ParameterHandle<T: ParameterType> { number: usize }
}

impl<R: Robot, T: ParameterType> ParameterHandle<R, T> {
    /// A new value for it, for [`Bus::set_parameters`](crate::Bus::set_parameters).
    pub fn to(self, value: impl Into<T>) -> (&'static str, ParameterValue) {
        (self.path, value.into().into_value())
    }
}

macro_rules! publisher {
    ($($handle:ident<$($component:ident: $bound:path),+> publishes $payload:ty;)*) => { $(
        #[diagnostic::do_not_recommend]
        impl<R: Robot, $($component: $bound),+> Publisher<R> for $handle<R, $($component),+> {
            type Payload = $payload;
            fn path(self) -> &'static str {
                self.path
            }
            fn topic<'a>(self, topics: &'a R::Topics, _: &'a SystemTopics) -> &'a Topic<$payload> {
                topic::<R, _>(topics, self.publisher)
            }
        }
    )* };
}

publisher! {
    SensorHandle<S: Sensor> publishes S::Output;
    EstimatorHandle<E: Estimator, T: Payload> publishes T;
    OutputHandle<T: Payload> publishes T;
    ControllerHandle<S: Service> publishes S::Output;
    BridgeHandle<S: Service> publishes S::Output;
}

macro_rules! system_publisher {
    ($($handle:ident<$($component:ident: $bound:path),+> publishes $payload:ty, $list:ident;)*) => { $(
        #[diagnostic::do_not_recommend]
        impl<R: Robot, $($component: $bound),+> Publisher<R> for $handle<R, $($component),+> {
            type Payload = $payload;
            fn path(self) -> &'static str {
                self.path
            }
            fn topic<'a>(self, _: &'a R::Topics, system: &'a SystemTopics) -> &'a Topic<$payload> {
                &system.$list[self.number]
            }
        }
    )* };
}

system_publisher! {
    CommandHandle<C: Command> publishes CommandEvent, commands;
    ParameterHandle<T: ParameterType> publishes ParameterChange, parameters;
}

macro_rules! system_topic {
    ($($(#[$doc:meta])* $name:ident at $path:literal publishes $payload:ty, $field:ident;)*) => { $(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        pub struct $name;

        #[diagnostic::do_not_recommend]
        impl<R: Robot> Publisher<R> for $name {
            type Payload = $payload;
            fn path(self) -> &'static str {
                $path
            }
            fn topic<'a>(self, _: &'a R::Topics, system: &'a SystemTopics) -> &'a Topic<$payload> {
                &system.$field
            }
        }
    )* };
}

system_topic! {
    /// Names the changes of health of all estimators.
    Health at "health" publishes HealthTransition, health;
    /// Names the changes of the operational state.
    StateMachine at "state_machine" publishes StateTransition, state;
    /// Names the changes of the safety state.
    SafetyState at "safety" publishes SafetyTransition, safety;
    /// Names the journal's topic, if it is published.
    JournalLines at "journal" publishes JournalLine, journal;
    /// Names the faults of components.
    Faults at "fault" publishes ComponentFault, fault;
    /// Names the errors that lead to the safety state `error`.
    SafetyErrors at "safety/error" publishes SafetyError, safety_error;
}

handle! {
    /// Names one output of an estimator of the robot `R`.
    OutputHandle<T: Payload> { publisher: usize }
}

macro_rules! visitable {
    ($($handle:ident<$($component:ident: $bound:path),+>),*) => { $(
        impl<R: Robot, $($component: $bound),+> Visitable<R> for $handle<R, $($component),+> {
            type Estimator = E;
            fn number(self) -> usize {
                self.number
            }
        }
    )* };
}

visitable!(EstimatorHandle<E: Estimator, T: Payload>, EstimatorOfSeveralHandle<E: Estimator>);

/// A component with options: the handle of a sensor or of an estimator.
pub trait Configurable<R: Robot>: Copy {
    /// Options of the component.
    type Options;
    /// Returns them from the options of the robot.
    #[doc(hidden)]
    fn options(self, options: &mut OptionsList) -> &mut Self::Options;
}

macro_rules! configurable {
    ($($handle:ident<$($component:ident: $bound:path),+> by $options:ty;)*) => { $(
        impl<R: Robot, $($component: $bound),+> Configurable<R> for $handle<R, $($component),+> {
            type Options = $options;
            fn options(self, options: &mut OptionsList) -> &mut $options {
                options.of_mut(self.component)
            }
        }
    )* };
}

configurable! {
    SensorHandle<S: Sensor> by S::Options;
    EstimatorHandle<E: Estimator, T: Payload> by E::Options;
    EstimatorOfSeveralHandle<E: Estimator> by E::Options;
    ActuatorHandle<A: Actuator> by A::Options;
    ControllerHandle<S: Service> by S::Options;
    BridgeHandle<S: Service> by S::Options;
    CommandHandle<C: Command> by C::Options;
}
