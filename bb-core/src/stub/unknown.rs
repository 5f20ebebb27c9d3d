//! The type that fits everywhere.

use super::stub;
use crate::component::inputs::LatestSlot;
use crate::component::{
    Actuator, ActuatorContext, Command, CommandContext, Context, Estimator, Fault, InputAt, InputField, Inputs,
    NoArguments, NoOptions, Outcome, Outputs, Reading, Reply, Sensor, SensorContext, Service, ServiceContext,
    SyncMiss,
};
use crate::message::Stamped;
use crate::time::MonotonicTime;
pub(crate) use bb_message::__private::UNKNOWN_INDEX;
pub use bb_message::__private::{NoField, Unknown};

/// The input of an unknown estimator: anything.
#[derive(Clone, Copy, Debug)]
pub struct UnknownInput;

/// The output of an unknown estimator: anything.
#[derive(Clone, Copy, Debug)]
pub struct UnknownOutput;

#[diagnostic::do_not_recommend]
impl Sensor for Unknown {
    type Options = NoOptions;
    type Output = Self;

    fn init(_: NoOptions, _: &SensorContext) -> Result<Self, Fault> {
        stub()
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Self>, Fault> {
        stub()
    }
}

#[diagnostic::do_not_recommend]
impl Estimator for Unknown {
    type Options = NoOptions;
    type Input = UnknownInput;
    type Output = UnknownOutput;
    const HANDLES_MOVING_JOINTS: bool = true;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        stub()
    }

    fn handle_input(&mut self, (): ()) -> Result<Reply<UnknownOutput>, Fault> {
        stub()
    }
}

#[diagnostic::do_not_recommend]
impl Actuator for Unknown {
    type Options = NoOptions;
    type Command = Self;

    fn init(_: NoOptions, _: &ActuatorContext) -> Result<Self, Fault> {
        stub()
    }

    fn handle_command(&mut self, _: &Stamped<Self>) -> Result<(), Fault> {
        stub()
    }

    fn disarm(&mut self) -> Result<(), Fault> {
        stub()
    }
}

#[diagnostic::do_not_recommend]
impl Service for Unknown {
    type Options = NoOptions;
    type Output = Self;

    fn init(_: NoOptions, _: &ServiceContext) -> Result<Self, Fault> {
        stub()
    }

    fn update(&mut self, _: MonotonicTime) -> Result<Reading<Self>, Fault> {
        stub()
    }
}

#[diagnostic::do_not_recommend]
impl Command for Unknown {
    type Options = NoOptions;
    type Arguments = NoArguments;
    type Output = ();

    async fn run(_: NoOptions, _: NoArguments, _: CommandContext) -> Result<Outcome<()>, Fault> {
        stub()
    }
}

impl Inputs for UnknownInput {
    type View<'a> = ();
    type Cache = ();
    type Nested = NoField;
    const FIELDS: &'static [InputField] = &[];
    const KNOWN: bool = false;
}

impl Outputs for UnknownOutput {
    type Only = NoField;
    const FIELDS: &'static [&'static str] = &[];
    const KNOWN: bool = false;
}

impl<I: Inputs> InputAt<UNKNOWN_INDEX> for I {
    type Payload = Unknown;
    type Slot = LatestSlot<Unknown>;

    fn slot(_: &mut I::Cache) -> Option<&mut LatestSlot<Unknown>> {
        None
    }

    fn snapshot<'a>(_: &'a mut I::Cache, _: &'a Stamped<Unknown>) -> Result<I::View<'a>, SyncMiss> {
        stub()
    }
}
