//! The messages of a reply: the output of an estimator is one payload, any number of them, or a struct with a field per output.
//!
//! They are implemented for all payloads and for lists of them, which only the crate that defines `Payload` may do.

pub(crate) mod unknown;

use crate::message::{Payload, Stamp, Stamped};
use crate::time::{MonotonicTime, WallTime};

/// The output of an estimator.
///
/// An estimator with one output names the payload: `type Output = Orientation;`, published at the estimator's own
/// path. One with several outputs derives a struct of `Option`s; each field that is `Some` is published at the path
/// of the `output` with its name.
///
/// | written | emits with each reply |
/// |---|---|
/// | `type Output = Pose;`, `Option<Pose>` in a struct | one message or none |
/// | `type Output = Vec<Pose>;`, `Vec<Pose>` in a struct | any number, in their order |
/// | [`Timed<Pose>`](Timed) instead of `Pose` in any of these | the same, each at the time that it says |
///
/// ```
/// use bb_core::prelude::*;
///
/// /// Where the robot is, how it moves, and what it sees.
/// #[derive(Debug, Default, Outputs)]
/// pub struct PoseOutputs {
///     /// The pose, at every dispatch.
///     pub pose: Option<Pose>,
///     /// The velocity, when there is a new one, at the time between two poses.
///     pub velocity: Option<Timed<Twist>>,
///     /// A message for each landmark in the image.
///     pub landmarks: Vec<RelativePose>,
/// }
/// ```
///
/// The messages of a `Vec` are published one after the other: all estimators that take the first have handled it when the second is
/// published. A `Vec` allocates; the other forms do not.
#[diagnostic::on_unimplemented(
    message = "`{Self}` cannot be the output of an estimator",
    label = "neither a payload nor a struct of outputs",
    note = "a message of one's own derives `Payload`: `#[derive(Clone, Debug, Payload)]`; a struct of several outputs \
            derives `Outputs`"
)]
pub trait Outputs: Sized + Send + 'static {
    /// The outputs by name; empty if the output is a single payload, whose name is `out`.
    const FIELDS: &'static [&'static str];

    /// `false` for the placeholder of an unknown estimator, in a robot that does not compile.
    #[doc(hidden)]
    const KNOWN: bool = true;

    /// The output published if none is declared: the single payload.
    #[doc(hidden)]
    type Only: EmittedAt<Self>;
}

/// A payload with a time of its own, for an output that is not of the time of the driving input's message: that of a sensor with a known
/// delay, an interpolation, a sample of a batch.
///
/// An output without one is stamped with the time of the driving input's message, or with the current time in reply to anything else.
/// Subscribers get the messages in the order in which they are published. An estimator takes those of an input in the order
/// of their times: an earlier one is dropped as *out of order*, and one that is more than a second ahead of the clock as *clock
/// skew*; both are counted. The frame is always that of the estimator's place, which the transforms of its consumers are computed
/// from.
///
/// ```
/// use bb_core::prelude::*;
///
/// /// The rate halfway between two samples, at the time halfway between them.
/// struct Midpoint {
///     last: Option<(MonotonicTime, f64)>,
/// }
///
/// #[derive(Clone, Copy, Debug, PartialEq, Payload)]
/// struct Rate {
///     /// rad/s
///     rate: f64,
/// }
///
/// impl Estimator for Midpoint {
///     type Options = NoOptions;
///     type Input = Imu;
///     type Output = Timed<Rate>;
///
///     fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
///         Ok(Self { last: None })
///     }
///
///     fn handle_input(&mut self, imu: &Stamped<Imu>) -> Result<Reply<Timed<Rate>>, Fault> {
///         let (time, rate) = (imu.monotonic_time, imu.angular_velocity.z);
///         let last = self.last.replace((time, rate));
///         Ok(last.map(|(before, rate_before)| {
///             let halfway = before.plus_nanos(time.nanos_since(before) / 2);
///             Timed::new(halfway, Rate { rate: (rate_before + rate) / 2.0 })
///         }).into())
///     }
/// }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timed<T> {
    /// Time of the measurement or the estimate.
    pub time: MonotonicTime,
    /// Message to publish.
    pub payload: T,
}

impl<T> Timed<T> {
    /// `payload` at `time`.
    pub const fn new(time: MonotonicTime, payload: T) -> Self {
        Self { time, payload }
    }
}

/// The number of a field in an input or output struct.
pub type FieldIndex = usize;

/// A field of an input or output struct, as a type: the expansion of `robot!` refers to fields by it.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
pub struct At<const I: FieldIndex>;

/// One emitted message: a payload, or one with a time of its own.
#[doc(hidden)]
pub trait Emitted: Send + 'static {
    /// Payload that it publishes.
    type Payload: Payload;

    /// The message; `stamp` is that of the reply.
    fn stamped(self, stamp: Stamp) -> Stamped<Self::Payload>;

    /// Value that emits that message.
    fn of(message: &Stamped<Self::Payload>) -> Self;
}

impl<T: Payload> Emitted for T {
    type Payload = T;

    #[inline(always)]
    fn stamped(self, stamp: Stamp) -> Stamped<T> {
        stamp.message(self)
    }

    fn of(message: &Stamped<T>) -> Self {
        message.payload.clone()
    }
}

impl<T: Payload> Emitted for Timed<T> {
    type Payload = T;

    #[inline]
    fn stamped(self, stamp: Stamp) -> Stamped<T> {
        let Self { time, payload } = self;
        let since = time.nanos_since(stamp.monotonic_time);
        let wall_time = WallTime::from_unix_nanos(stamp.wall_time.as_unix_nanos().saturating_add(since));
        Stamp { monotonic_time: time, wall_time, ..stamp }.message(payload)
    }

    fn of(message: &Stamped<T>) -> Self {
        Self { time: message.monotonic_time, payload: message.payload.clone() }
    }
}

/// The messages of one output in one reply: none or one, or any number.
#[doc(hidden)]
pub trait OutputField: Default {
    /// Payload of the messages.
    type Payload: Payload;

    /// Takes them, and hands each to `publish`.
    fn each(&mut self, stamp: Stamp, publish: impl FnMut(&Stamped<Self::Payload>));

    /// Value that emits only that message.
    fn alone(message: &Stamped<Self::Payload>) -> Self;
}

impl<E: Emitted> OutputField for Option<E> {
    type Payload = E::Payload;

    #[inline(always)]
    fn each(&mut self, stamp: Stamp, mut publish: impl FnMut(&Stamped<E::Payload>)) {
        if let Some(emitted) = self.take() {
            publish(&emitted.stamped(stamp));
        }
    }

    fn alone(message: &Stamped<E::Payload>) -> Self {
        Some(E::of(message))
    }
}

impl<E: Emitted> OutputField for Vec<E> {
    type Payload = E::Payload;

    #[inline]
    fn each(&mut self, stamp: Stamp, mut publish: impl FnMut(&Stamped<E::Payload>)) {
        for emitted in std::mem::take(self) {
            publish(&emitted.stamped(stamp));
        }
    }

    fn alone(message: &Stamped<E::Payload>) -> Self {
        vec![E::of(message)]
    }
}

/// Output number `I` of `Self` exists, and can be taken out of an emitted value.
#[doc(hidden)]
pub trait OutputAt<const I: FieldIndex>: Outputs {
    /// Payload of the output.
    type Payload: Payload;

    /// Takes its messages, if any were emitted, and hands each to `publish`.
    fn each(emitted: &mut Option<Self>, stamp: Stamp, publish: impl FnMut(&Stamped<Self::Payload>));

    /// The value that emits only that message, at this output.
    fn alone(message: &Stamped<Self::Payload>) -> Self;
}

/// [`OutputAt`] implemented by the field: a type is named once, while a number would be computed at each use.
#[doc(hidden)]
pub trait EmittedAt<T>: 'static {
    /// Payload of the output.
    type Payload: Payload;

    /// See [`OutputAt::each`].
    fn each(emitted: &mut Option<T>, stamp: Stamp, publish: impl FnMut(&Stamped<Self::Payload>));

    /// See [`OutputAt::alone`].
    fn alone(message: &Stamped<Self::Payload>) -> T;
}

impl<T: OutputAt<I>, const I: FieldIndex> EmittedAt<T> for At<I> {
    type Payload = T::Payload;

    #[inline(always)]
    fn each(emitted: &mut Option<T>, stamp: Stamp, publish: impl FnMut(&Stamped<T::Payload>)) {
        T::each(emitted, stamp, publish);
    }

    fn alone(message: &Stamped<T::Payload>) -> T {
        T::alone(message)
    }
}

impl<T: Payload> Outputs for T {
    const FIELDS: &'static [&'static str] = &[];
    type Only = At<0>;
}

impl<T: Payload> OutputAt<0> for T {
    type Payload = T;

    #[inline(always)]
    fn each(emitted: &mut Option<T>, stamp: Stamp, publish: impl FnMut(&Stamped<T>)) {
        emitted.each(stamp, publish);
    }

    fn alone(message: &Stamped<T>) -> T {
        T::of(message)
    }
}

impl<T: Payload> Outputs for Timed<T> {
    const FIELDS: &'static [&'static str] = &[];
    type Only = At<0>;
}

impl<T: Payload> OutputAt<0> for Timed<T> {
    type Payload = T;

    #[inline]
    fn each(emitted: &mut Option<Self>, stamp: Stamp, publish: impl FnMut(&Stamped<T>)) {
        emitted.each(stamp, publish);
    }

    fn alone(message: &Stamped<T>) -> Self {
        Self::of(message)
    }
}

impl<E: Emitted> Outputs for Vec<E> {
    const FIELDS: &'static [&'static str] = &[];
    type Only = At<0>;
}

impl<E: Emitted> OutputAt<0> for Vec<E> {
    type Payload = E::Payload;

    #[inline]
    fn each(emitted: &mut Option<Self>, stamp: Stamp, publish: impl FnMut(&Stamped<E::Payload>)) {
        if let Some(all) = emitted {
            all.each(stamp, publish);
        }
    }

    fn alone(message: &Stamped<E::Payload>) -> Self {
        OutputField::alone(message)
    }
}
