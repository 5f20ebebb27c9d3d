//! Typed names of what a robot declares; `robot!` generates one per publisher, at its path.

use super::Robot;
use crate::component::{Estimator, Sensor};
use crate::message::{Frame, Payload, Stamp, Stamped};
use crate::pubsub::Topic;
use std::fmt;

/// What can be subscribed to: the handle of a sensor, of an estimator of one output, or of an output.
#[diagnostic::on_unimplemented(
    message = "`{Self}` cannot be subscribed to",
    label = "publishes nothing under this name",
    note = "an estimator of several outputs is subscribed to output by output"
)]
pub trait Publisher<R: Robot>: Copy {
    /// What it publishes.
    type Payload: Payload;
    /// Its path.
    fn path(self) -> &'static str;
    /// Its topic.
    #[doc(hidden)]
    fn topic(self, topics: &R::Topics) -> &Topic<Self::Payload>;
}

type TopicOf<R, T> = fn(&<R as Robot>::Topics) -> &Topic<T>;
type OptionsOf<R, O> = fn(&mut <R as Robot>::Options) -> &mut O;
type PublishOf<R, T> = fn(&<R as Robot>::Wiring, &Stamped<T>);

macro_rules! handle {
    ($(#[$doc:meta])* $name:ident<$($component:ident: $bound:path),+> { $($field:ident: $type:ty),* }) => {
        $(#[$doc])*
        pub struct $name<R: Robot, $($component: $bound),+> {
            path: &'static str,
            $($field: $type,)*
        }

        impl<R: Robot, $($component: $bound),+> $name<R, $($component),+> {
            #[doc(hidden)]
            pub const fn new(path: &'static str, $($field: $type),*) -> Self {
                Self { path, $($field),* }
            }

            /// Its path.
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
        frame: Frame,
        topic: TopicOf<R, S::Output>,
        options: OptionsOf<R, S::Options>,
        publish: PublishOf<R, S::Output>
    }
}

handle! {
    /// Names an estimator of one output, `T`, of the robot `R`.
    EstimatorHandle<E: Estimator, T: Payload> { topic: TopicOf<R, T>, options: OptionsOf<R, E::Options> }
}

handle! {
    /// Names an estimator of several outputs of the robot `R`; each [`OutputHandle`] stands below it.
    EstimatorOfSeveralHandle<E: Estimator> { options: OptionsOf<R, E::Options> }
}

handle! {
    /// Names one output of an estimator of the robot `R`.
    OutputHandle<T: Payload> { topic: TopicOf<R, T> }
}

impl<R: Robot, S: Sensor> SensorHandle<R, S> {
    /// Publishes `payload` with the stamp, in the sensor's frame.
    pub(super) fn publish(self, wiring: &R::Wiring, stamp: Stamp, payload: S::Output) {
        (self.publish)(wiring, &Stamp { frame: self.frame, ..stamp }.message(payload));
    }
}

impl<R: Robot, S: Sensor> Publisher<R> for SensorHandle<R, S> {
    type Payload = S::Output;
    fn path(self) -> &'static str {
        self.path
    }
    fn topic(self, topics: &R::Topics) -> &Topic<S::Output> {
        (self.topic)(topics)
    }
}

impl<R: Robot, E: Estimator, T: Payload> Publisher<R> for EstimatorHandle<R, E, T> {
    type Payload = T;
    fn path(self) -> &'static str {
        self.path
    }
    fn topic(self, topics: &R::Topics) -> &Topic<T> {
        (self.topic)(topics)
    }
}

impl<R: Robot, T: Payload> Publisher<R> for OutputHandle<R, T> {
    type Payload = T;
    fn path(self) -> &'static str {
        self.path
    }
    fn topic(self, topics: &R::Topics) -> &Topic<T> {
        (self.topic)(topics)
    }
}

/// What has options: the handle of a sensor or of an estimator.
pub trait Configurable<R: Robot>: Copy {
    /// Its options.
    type Options;
    /// Them, among those of the robot.
    #[doc(hidden)]
    fn options(self, options: &mut R::Options) -> &mut Self::Options;
}

impl<R: Robot, S: Sensor> Configurable<R> for SensorHandle<R, S> {
    type Options = S::Options;
    fn options(self, options: &mut R::Options) -> &mut S::Options {
        (self.options)(options)
    }
}

impl<R: Robot, E: Estimator, T: Payload> Configurable<R> for EstimatorHandle<R, E, T> {
    type Options = E::Options;
    fn options(self, options: &mut R::Options) -> &mut E::Options {
        (self.options)(options)
    }
}

impl<R: Robot, E: Estimator> Configurable<R> for EstimatorOfSeveralHandle<R, E> {
    type Options = E::Options;
    fn options(self, options: &mut R::Options) -> &mut E::Options {
        (self.options)(options)
    }
}
