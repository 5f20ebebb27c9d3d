//! The input of an estimator: one payload, or a struct with a field per input.
//!
//! The estimator gets the driving input's message by reference. Every other input has a [`Slot`] that keeps its latest
//! message, or all messages since the last dispatch. When the driving input's message arrives, [`InputAt::snapshot`] checks
//! the slots against its time, and builds the estimator's input struct or names the input that was missing or too old.

mod every;
mod latest;
mod slot;

pub use every::{Every, EverySlot};
pub use latest::{Input, LatestSlot};
pub use slot::{Slot, SyncMiss};

use crate::declaration::EstimatorDeclaration;
use crate::message::Payload;
use crate::message::Stamped;
use bb_message::outputs::{At, FieldIndex};

/// The input of an estimator.
///
/// An estimator with one input names the payload: `type Input = Imu;`, and its `handle_input` gets `&Stamped<Imu>`.
/// One with several inputs derives a struct whose fields are the inputs by name. [`Input`] is the latest message; in
/// an `Option`, the estimator can run without that input. [`Every`] is all messages since the last run, none or several:
/// for events, and for measurements that must not be skipped.
///
/// ```
/// use bb_core::prelude::*;
///
/// /// The inputs for a wheeled robot's pose.
/// #[derive(Debug, Inputs)]
/// pub struct PoseInputs<'a> {
///     /// The inertial sensor.
///     pub imu: Input<'a, Imu>,
///     /// The wheels.
///     pub odometry: Input<'a, Odometry>,
///     /// Magnetic heading, if the robot has it.
///     pub magnetic_field: Option<Input<'a, MagneticField>>,
///     /// Fixes of the receiver, none of which is skipped.
///     pub gnss: Every<'a, GnssFix>,
/// }
/// ```
///
/// The estimator names it with the lifetime `'static`, `type Input = PoseInputs<'static>;`. Without the lifetime,
/// rustc suggests a lifetime parameter on the implementation, which does not compile either.
#[diagnostic::on_unimplemented(
    message = "`{Self}` cannot be the input of an estimator",
    label = "neither a payload nor a struct of inputs",
    note = "name a payload, or derive a struct of several: `#[derive(Inputs)]`"
)]
pub trait Inputs: 'static {
    /// The argument of `handle_input`.
    type View<'a>;
    /// The slots of the inputs.
    #[doc(hidden)]
    type Cache: Default + Send + 'static;
    /// The field that a nested estimator's sensor feeds: the only required one.
    #[doc(hidden)]
    type Nested: TakenAt<Self>;
    /// The inputs by name; empty if the input is a single payload.
    const FIELDS: &'static [InputField];

    /// `false` for the placeholder of an unknown estimator, in a robot that does not compile.
    #[doc(hidden)]
    const KNOWN: bool = true;
}

/// The description of one field of an input struct.
#[derive(Clone, Copy, Debug)]
pub struct InputField {
    /// Name.
    pub name: &'static str,
    /// `true` if the estimator can run without the input.
    pub optional: bool,
}

/// Input number `I` of `Self` exists: its payload, and how its arrival is handled.
#[doc(hidden)]
pub trait InputAt<const I: FieldIndex>: Inputs {
    /// The payload it takes.
    type Payload: Payload;

    /// Store of the input's messages until the driving input arrives.
    type Slot: Slot<Self::Payload>;

    /// Returns the input's slot; `None` if the estimator takes only a single payload, which needs no cache.
    fn slot(cache: &mut Self::Cache) -> Option<&mut Self::Slot>;

    /// The estimator's input when this input is the driver and `message` has arrived.
    fn snapshot<'a>(
        cache: &'a mut Self::Cache,
        message: &'a Stamped<Self::Payload>,
    ) -> Result<Self::View<'a>, SyncMiss>;
}

/// [`InputAt`] implemented by the field: a type is named once, while a number would be computed at each use.
#[doc(hidden)]
pub trait TakenAt<T: Inputs + ?Sized>: 'static {
    /// Number of the field.
    const INDEX: FieldIndex;

    /// The payload it takes.
    type Payload: Payload;

    /// See [`InputAt::Slot`].
    type Slot: Slot<Self::Payload>;

    /// See [`InputAt::slot`].
    fn slot(cache: &mut T::Cache) -> Option<&mut Self::Slot>;

    /// See [`InputAt::snapshot`].
    fn snapshot<'a>(cache: &'a mut T::Cache, message: &'a Stamped<Self::Payload>) -> Result<T::View<'a>, SyncMiss>;
}

impl<T: InputAt<I>, const I: FieldIndex> TakenAt<T> for At<I> {
    const INDEX: FieldIndex = I;
    type Payload = T::Payload;
    type Slot = T::Slot;

    #[inline(always)]
    fn slot(cache: &mut T::Cache) -> Option<&mut T::Slot> {
        T::slot(cache)
    }

    #[inline(always)]
    fn snapshot<'a>(cache: &'a mut T::Cache, message: &'a Stamped<T::Payload>) -> Result<T::View<'a>, SyncMiss> {
        T::snapshot(cache, message)
    }
}

impl<T: Payload> Inputs for T {
    type View<'a> = &'a Stamped<T>;
    type Cache = ();
    type Nested = At<0>;
    const FIELDS: &'static [InputField] = &[];
}

impl<T: Payload> InputAt<0> for T {
    type Payload = T;
    type Slot = LatestSlot<T>;

    fn slot(_: &mut ()) -> Option<&mut LatestSlot<T>> {
        None
    }

    #[inline(always)]
    fn snapshot<'a>((): &'a mut (), message: &'a Stamped<T>) -> Result<&'a Stamped<T>, SyncMiss> {
        Ok(message)
    }
}

/// Sets the declared input of an estimator that fills the field `F`.
#[doc(hidden)]
pub fn declare<F: TakenAt<T>, T: Inputs>(
    cache: &mut T::Cache,
    estimator: &'static EstimatorDeclaration,
    input: usize,
) {
    if let (Some(slot), Some(declared)) = (F::slot(cache), estimator.inputs.get(input)) {
        slot.declare(declared);
    }
}
