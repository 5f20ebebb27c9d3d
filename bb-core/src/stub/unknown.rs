//! The type that fits everywhere.

use super::stub;
use crate::component::inputs::LatestSlot;
use crate::component::{
    Actuator, ActuatorContext, At, Command, CommandContext, Context, Estimator, Fault, InputAt, InputField, Inputs,
    NoArguments, NoOptions, Outcome, OutputAt, Outputs, Reading, Reply, Sensor, SensorContext, Service,
    ServiceContext, SyncMiss,
};
use crate::message::codec::{Reader, Shape, Writer};
use crate::message::{DecodeError, Field, Finite, Payload, Stamp, Stamped};
use crate::time::MonotonicTime;

/// A payload, sensor, estimator and so on, used wherever the real one is not known.
#[derive(Clone, Copy, Debug)]
pub struct Unknown;

/// The input of an unknown estimator: anything.
#[derive(Clone, Copy, Debug)]
pub struct UnknownInput;

/// The output of an unknown estimator: anything.
#[derive(Clone, Copy, Debug)]
pub struct UnknownOutput;

/// The number of an input or output that does not exist.
pub(crate) const UNKNOWN_INDEX: usize = usize::MAX;

/// The field of an input or output that does not exist.
pub type NoField = At<UNKNOWN_INDEX>;

impl Finite for Unknown {
    fn is_finite(&self) -> bool {
        true
    }
}

#[diagnostic::do_not_recommend]
impl Field for Unknown {
    const SHAPE: Shape = <()>::SHAPE;
    const IS_INLINE: bool = true;

    fn write(&self, _: &mut Writer<'_>) {}

    fn read(_: &mut Reader<'_>) -> Result<Self, DecodeError> {
        stub()
    }
}

impl Payload for Unknown {
    const NAME: &'static str = "unknown";
    const KNOWN: bool = false;
    const TELLS_JOINT_POSITION: bool = true;
}

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

impl<O: Outputs> OutputAt<UNKNOWN_INDEX> for O {
    type Payload = Unknown;

    fn each(_: &mut Option<O>, _: Stamp, _: impl FnMut(&Stamped<Unknown>)) {}

    fn alone(_: &Stamped<Unknown>) -> O {
        stub()
    }
}
