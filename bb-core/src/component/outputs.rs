//! The output of an estimator: one payload, or a struct with a field per output.

use super::{At, FieldIndex};
use crate::message::Payload;

/// The output of an estimator.
///
/// An estimator with one output names the payload: `type Output = Orientation;`, published at the estimator's own
/// path. One with several outputs derives a struct of `Option`s; each field that is `Some` is published at the path
/// of the `output` with its name.
///
/// ```
/// use bb_core::prelude::*;
///
/// /// Where the robot is and how it moves.
/// #[derive(Debug, Default, Outputs)]
/// pub struct PoseOutputs {
///     /// The pose, at every dispatch.
///     pub pose: Option<Pose>,
///     /// The velocity, when there is a new one.
///     pub velocity: Option<Twist>,
/// }
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` cannot be the output of an estimator",
    label = "neither a payload nor a struct of outputs",
    note = "a message of one's own derives `Payload`: `#[derive(Clone, Debug, Payload)]`; a struct of several outputs \
            derives `Outputs`"
)]
pub trait Outputs: Sized + Send + 'static {
    /// The outputs by name; empty if the output is a single payload, whose name is `out`.
    const FIELDS: &'static [&'static str];

    /// False for the placeholder of an unknown estimator, in a robot that does not compile.
    #[doc(hidden)]
    const KNOWN: bool = true;

    /// The output published if none is declared: the single payload.
    #[doc(hidden)]
    type Only: EmittedAt<Self>;
}

/// Output number `I` of `Self` exists, and can be taken out of an emitted value.
#[doc(hidden)]
pub trait OutputAt<const I: FieldIndex>: Outputs {
    /// Its payload.
    type Payload: Payload;

    /// Takes it, if it was emitted.
    fn take(emitted: &mut Option<Self>) -> Option<Self::Payload>;

    /// The value that emits only this output.
    fn alone(payload: Self::Payload) -> Self;
}

/// [`OutputAt`] implemented by the field; see [`TakenAt`](super::TakenAt).
#[doc(hidden)]
pub trait EmittedAt<T>: 'static {
    /// Its payload.
    type Payload: Payload;

    /// See [`OutputAt::take`].
    fn take(emitted: &mut Option<T>) -> Option<Self::Payload>;

    /// See [`OutputAt::alone`].
    fn alone(payload: Self::Payload) -> T;
}

impl<T: OutputAt<I>, const I: FieldIndex> EmittedAt<T> for At<I> {
    type Payload = T::Payload;

    #[inline(always)]
    fn take(emitted: &mut Option<T>) -> Option<T::Payload> {
        T::take(emitted)
    }

    fn alone(payload: T::Payload) -> T {
        T::alone(payload)
    }
}

impl<T: Payload> Outputs for T {
    const FIELDS: &'static [&'static str] = &[];
    type Only = At<0>;
}

impl<T: Payload> OutputAt<0> for T {
    type Payload = T;

    #[inline(always)]
    fn take(emitted: &mut Option<T>) -> Option<T> {
        emitted.take()
    }

    fn alone(payload: T) -> T {
        payload
    }
}
