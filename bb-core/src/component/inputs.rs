//! The input of an estimator: one payload, or a struct with a field per input.
//!
//! The estimator gets the driver's message by reference. Every other input has a [`Slot`] that keeps its latest
//! message. When the driver's message arrives, [`InputAt::snapshot`] checks the slots against its time, and builds
//! the estimator's input struct or names the input that was missing or too old.

use crate::Payload;
use crate::declaration::{EstimatorDeclaration, InputDeclaration};
use crate::message::{Panic, Stamped, copy_to};
use crate::time::MonotonicTime;
use std::cell::Cell;
use std::ops::Deref;

/// The input of an estimator.
///
/// An estimator with one input names the payload: `type Input = Imu;`, and its `handle_input` gets `&Stamped<Imu>`.
/// One with several inputs derives a struct whose fields are the inputs by name; an `Option` means that the estimator
/// can run without that input.
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
    /// The latest message of each input.
    #[doc(hidden)]
    type Cache: Default + Send + 'static;
    /// The field that a nested estimator's sensor feeds: the only required one.
    #[doc(hidden)]
    type Nested: TakenAt<Self>;
    /// The inputs by name; empty if the input is a single payload.
    const FIELDS: &'static [InputField];

    /// False for the placeholder of an unknown estimator, in a robot that does not compile.
    #[doc(hidden)]
    const KNOWN: bool = true;
}

/// The description of one field of an input struct.
#[derive(Clone, Copy, Debug)]
pub struct InputField {
    /// Its name.
    pub name: &'static str,
    /// Whether the estimator can run without it.
    pub optional: bool,
}

/// The number of a field in an input or output struct.
pub type FieldIndex = usize;

/// A field of an input or output struct, as a type: the expansion of `robot!` refers to fields by it.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
pub struct At<const I: FieldIndex>;

/// One input of a struct: its message, and whether it is new since the last dispatch.
#[derive(Debug)]
pub struct Input<'a, T> {
    message: &'a Stamped<T>,
    is_new: bool,
}

impl<T> Clone for Input<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Input<'_, T> {}

impl<'a, T> Input<'a, T> {
    /// A message that has arrived since the last dispatch.
    pub fn new(message: &'a Stamped<T>) -> Self {
        Self { message, is_new: true }
    }

    /// A message that an earlier dispatch has seen already.
    pub fn seen(message: &'a Stamped<T>) -> Self {
        Self { message, is_new: false }
    }

    /// Whether it has arrived since the last dispatch, so that each reading of a slow sensor is fused once.
    pub fn is_new(&self) -> bool {
        self.is_new
    }

    /// The message.
    pub fn message(&self) -> &'a Stamped<T> {
        self.message
    }
}

impl<T> Deref for Input<'_, T> {
    type Target = Stamped<T>;
    fn deref(&self) -> &Stamped<T> {
        self.message
    }
}

/// Input number `I` of `Self` exists: its payload, and how its arrival is handled.
#[doc(hidden)]
pub trait InputAt<const I: FieldIndex>: Inputs {
    /// The payload it takes.
    type Payload: Payload;

    /// Its slot; `None` if the estimator takes only a single payload, which needs no cache.
    fn slot(cache: &mut Self::Cache) -> Option<&mut Slot<Self::Payload>>;

    /// The estimator's input when this input is the driver and `message` has arrived.
    fn snapshot<'a>(
        cache: &'a mut Self::Cache,
        message: &'a Stamped<Self::Payload>,
    ) -> Result<Self::View<'a>, SyncMiss>;
}

/// [`InputAt`] implemented by the field: a type is named once, while a number would be computed at each use.
#[doc(hidden)]
pub trait TakenAt<T: Inputs + ?Sized>: 'static {
    /// Its number.
    const INDEX: FieldIndex;

    /// The payload it takes.
    type Payload: Payload;

    /// See [`InputAt::slot`].
    fn slot(cache: &mut T::Cache) -> Option<&mut Slot<Self::Payload>>;

    /// See [`InputAt::snapshot`].
    fn snapshot<'a>(cache: &'a mut T::Cache, message: &'a Stamped<Self::Payload>) -> Result<T::View<'a>, SyncMiss>;
}

impl<T: InputAt<I>, const I: FieldIndex> TakenAt<T> for At<I> {
    const INDEX: FieldIndex = I;
    type Payload = T::Payload;

    #[inline(always)]
    fn slot(cache: &mut T::Cache) -> Option<&mut Slot<T::Payload>> {
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

    fn slot(_: &mut ()) -> Option<&mut Slot<T>> {
        None
    }

    #[inline(always)]
    fn snapshot<'a>((): &'a mut (), message: &'a Stamped<T>) -> Result<&'a Stamped<T>, SyncMiss> {
        Ok(message)
    }
}

/// The latest message of one input, and how old it may be.
#[doc(hidden)]
#[derive(Debug)]
pub struct Slot<T> {
    message: Option<Stamped<T>>,
    is_new: Cell<bool>,
    declaration: Option<&'static InputDeclaration>,
}

impl<T> Default for Slot<T> {
    fn default() -> Self {
        Self { message: None, is_new: Cell::new(false), declaration: None }
    }
}

/// The input because of which a dispatch was dropped.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SyncMiss {
    /// Its number among the declared inputs.
    pub input: usize,
    /// How much older than the driver it was; `None` if it has not arrived yet.
    pub age_nanos: Option<i64>,
}

impl<T: Payload> Slot<T> {
    /// Sets the declared input that fills it.
    pub fn declare(&mut self, declaration: &'static InputDeclaration) {
        self.declaration = Some(declaration);
    }

    /// Keeps `message` as the latest. If the payload's `Clone` panics, the panic is returned and the message is still
    /// kept.
    #[inline]
    pub(crate) fn store(&mut self, message: &Stamped<T>) -> Result<(), Panic> {
        self.is_new.set(true);
        copy_to(&mut self.message, message)
    }

    /// The miss of a required input that has not arrived, or is too old for a driver of `time`; `None` if there is no
    /// miss.
    pub fn miss(&self, time: MonotonicTime) -> Option<SyncMiss> {
        let declaration = self.declaration.filter(|declaration| !declaration.optional)?;
        let Some(message) = &self.message else {
            return Some(SyncMiss { input: declaration.index, age_nanos: None });
        };
        let age_nanos = time.nanos_since(message.monotonic_time);
        declaration
            .is_too_old(age_nanos)
            .then_some(SyncMiss { input: declaration.index, age_nanos: Some(age_nanos) })
    }

    /// Returns the message if it has arrived and is not too old for a driver of `time`, and marks it as seen.
    pub fn take(&self, time: MonotonicTime) -> Option<Input<'_, T>> {
        let message = self.message.as_ref()?;
        let is_too_old = self.declaration?.is_too_old(time.nanos_since(message.monotonic_time));
        (!is_too_old).then(|| Input { message, is_new: self.is_new.replace(false) })
    }

    /// The message of a required input; the error is that of [`Self::miss`].
    pub fn require(&self, time: MonotonicTime) -> Result<Input<'_, T>, SyncMiss> {
        let input = self.declaration.map_or(usize::MAX, |declaration| declaration.index);
        self.take(time).ok_or(SyncMiss { input, age_nanos: None })
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
