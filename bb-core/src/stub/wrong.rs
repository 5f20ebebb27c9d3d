//! A component whose implementation is wrong.

use super::{Unknown, stub};
use crate::component::{
    Actuator, ActuatorContext, Command, CommandContext, Context, Estimator, Fault, NoArguments, Outcome, Reading,
    Reply, Sensor, SensorContext, Service, ServiceContext,
};
use crate::message::Stamped;
use crate::time::MonotonicTime;
use std::marker::PhantomData;

/// A component with the options of `T`, whose implementation rustc reports where it is, such as one of a type that cannot
/// be sent to another thread. Named as itself, `T` would be reported where it is declared, too.
#[derive(Debug)]
pub struct Wrong<T>(PhantomData<fn() -> T>);

#[diagnostic::do_not_recommend]
impl<T: Sensor> Sensor for Wrong<T> {
    type Options = T::Options;
    type Output = Unknown;

    fn init(_: T::Options, _: &SensorContext) -> Result<Self, Fault> {
        stub()
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Unknown>, Fault> {
        stub()
    }
}

#[diagnostic::do_not_recommend]
impl<T: Estimator> Estimator for Wrong<T> {
    type Options = T::Options;
    type Input = Unknown;
    type Output = Unknown;

    fn init(_: T::Options, _: &Context) -> Result<Self, Fault> {
        stub()
    }

    fn handle_input(&mut self, _: &Stamped<Unknown>) -> Result<Reply<Unknown>, Fault> {
        stub()
    }
}

#[diagnostic::do_not_recommend]
impl<T: Actuator> Actuator for Wrong<T> {
    type Options = T::Options;
    type Command = Unknown;

    fn init(_: T::Options, _: &ActuatorContext) -> Result<Self, Fault> {
        stub()
    }

    fn handle_command(&mut self, _: &Stamped<Unknown>) -> Result<(), Fault> {
        stub()
    }

    fn disarm(&mut self) -> Result<(), Fault> {
        stub()
    }
}

#[diagnostic::do_not_recommend]
impl<T: Service> Service for Wrong<T> {
    type Options = T::Options;
    type Output = Unknown;

    fn init(_: T::Options, _: &ServiceContext) -> Result<Self, Fault> {
        stub()
    }

    fn update(&mut self, _: MonotonicTime) -> Result<Reading<Unknown>, Fault> {
        stub()
    }
}

#[diagnostic::do_not_recommend]
impl<T: Command> Command for Wrong<T> {
    type Options = T::Options;
    type Arguments = NoArguments;
    type Output = ();

    async fn run(_: T::Options, _: NoArguments, _: CommandContext) -> Result<Outcome<()>, Fault> {
        stub()
    }
}
