//! Placeholders, so that one mistake gives one message.
//!
//! A type that is declared as a sensor but is not one would be reported at each use in the wiring. So the wiring
//! refers to it through [`Known`], which replaces such a type by [`Unknown`], a type that fits everywhere. The
//! mistake is reported once: where the options are set, or where the type implements the trait wrongly. An input or output that the algorithm does not have is
//! `Unknown` as well, and is reported by its check (see `check`). None of this ever runs, since such a robot does not
//! compile.

mod unknown;
mod wrong;

pub(crate) use unknown::UNKNOWN_INDEX;
pub use unknown::{NoField, Unknown};
use wrong::Wrong;

use crate::component::{Actuator, Command, Estimator, Inputs, Options, Outputs, Sensor, Service};
use crate::message::Payload;
use std::any::Any;
use std::marker::PhantomData;

/// Constants that tell whether `T` is a sensor, an estimator, …: its inherent constants if it is, otherwise those of
/// [`NotProbed`], since inherent ones take precedence.
#[derive(Debug)]
pub struct Probe<T>(PhantomData<fn() -> T>);

// `Send` and the bounds of associated types are repeated: an implementation that violates one is reported there, and does not
// count.
impl<T> Probe<T>
where
    T: Sensor<Options: Options, Output: Payload> + Send,
{
    /// `T` is a sensor.
    pub const IS_SENSOR: bool = true;
}

impl<T> Probe<T>
where
    T: Estimator<Options: Options, Input: Inputs, Output: Outputs> + Send,
{
    /// `T` is an estimator.
    pub const IS_ESTIMATOR: bool = true;
}

impl<T> Probe<T>
where
    T: Actuator<Options: Options, Command: Payload> + Send,
{
    /// `T` is an actuator.
    pub const IS_ACTUATOR: bool = true;
}

impl<T> Probe<T>
where
    T: Service<Options: Options, Output: Payload> + Send,
{
    /// `T` is a service.
    pub const IS_SERVICE: bool = true;
}

impl<T> Probe<T>
where
    T: Command<Options: Options> + Send,
{
    /// `T` is a command.
    pub const IS_COMMAND: bool = true;
}

impl<T: Sensor> Probe<T> {
    /// `T` implements the trait, correctly or not.
    pub const IMPLEMENTS_SENSOR: bool = true;
}

impl<T: Estimator> Probe<T> {
    /// `T` implements the trait, correctly or not.
    pub const IMPLEMENTS_ESTIMATOR: bool = true;
}

impl<T: Actuator> Probe<T> {
    /// `T` implements the trait, correctly or not.
    pub const IMPLEMENTS_ACTUATOR: bool = true;
}

impl<T: Service> Probe<T> {
    /// `T` implements the trait, correctly or not.
    pub const IMPLEMENTS_SERVICE: bool = true;
}

impl<T: Command> Probe<T> {
    /// `T` implements the trait, correctly or not.
    pub const IMPLEMENTS_COMMAND: bool = true;
}

/// Fallback: every constant is `false`.
pub trait NotProbed {
    /// Not a sensor.
    const IS_SENSOR: bool = false;
    /// Not an estimator.
    const IS_ESTIMATOR: bool = false;
    /// Not an actuator.
    const IS_ACTUATOR: bool = false;
    /// Not a service.
    const IS_SERVICE: bool = false;
    /// Not a command.
    const IS_COMMAND: bool = false;
    /// No implementation of the trait.
    const IMPLEMENTS_SENSOR: bool = false;
    /// No implementation of the trait.
    const IMPLEMENTS_ESTIMATOR: bool = false;
    /// No implementation of the trait.
    const IMPLEMENTS_ACTUATOR: bool = false;
    /// No implementation of the trait.
    const IMPLEMENTS_SERVICE: bool = false;
    /// No implementation of the trait.
    const IMPLEMENTS_COMMAND: bool = false;
}

impl<T> NotProbed for Probe<T> {}

/// A declared type, and whether it implements the trait it was declared with: see [`implemented`].
#[derive(Debug)]
pub struct Probed<T, const IMPLEMENTED: u8>(PhantomData<fn() -> T>);

/// Not implemented.
const NO: u8 = 0;
/// Implemented.
const YES: u8 = 1;
/// Implemented in a way that rustc reports at the implementation.
const WRONGLY: u8 = 2;

/// Returns how a type implements its trait, by the constants of [`Probe`].
pub const fn implemented(is: bool, implements: bool) -> u8 {
    match (is, implements) {
        (true, _) => YES,
        (false, true) => WRONGLY,
        (false, false) => NO,
    }
}

/// The types to use for a declared one.
pub trait Known {
    /// The type itself if it implements the trait, otherwise [`Unknown`].
    type Type;
    /// The type whose options are set, where a type that does not implement the trait is reported.
    type Given;
}

impl<T> Known for Probed<T, YES> {
    type Type = T;
    type Given = T;
}

impl<T> Known for Probed<T, NO> {
    type Type = Unknown;
    type Given = T;
}

impl<T> Known for Probed<T, WRONGLY> {
    type Type = Unknown;
    type Given = Wrong<T>;
}

/// Returns whether both payloads are known, and must therefore be equal.
pub const fn both_known<P: Payload, T: Payload>() -> bool {
    P::KNOWN && T::KNOWN
}

/// The options of a component in the type that the wiring uses: unchanged, except for a type that is not a component.
pub fn as_known<T: 'static, U: 'static>(options: U) -> T {
    let mut options = Some(options);
    let known = (&mut options as &mut dyn Any).downcast_mut::<Option<T>>();
    known.and_then(Option::take).unwrap_or_else(stub)
}

/// A value of any type that a stub must return.
#[expect(clippy::panic, reason = "such a robot does not compile")]
pub fn stub<T>() -> T {
    panic!("this robot did not verify")
}

/// An empty implementation of `Robot`, for a robot that failed to verify.
#[doc(hidden)]
#[macro_export]
macro_rules! __stub_robot {
    ($robot:ty, $name:literal) => {
        impl $crate::Robot for $robot {
            const NAME: &'static str = $name;
            const TOPOLOGY: &'static $crate::topology::Topology =
                &$crate::topology::Topology { links: &[], joints: &[] };
            const SENSORS: &'static [$crate::__private::SensorDeclaration] = &[];
            const ESTIMATORS: &'static [$crate::__private::EstimatorDeclaration] = &[];
            const ACTUATORS: &'static [$crate::__private::ActuatorDeclaration] = &[];
            const SERVICES: &'static [$crate::__private::SensorDeclaration] = &[];
            const STATES: &'static [&'static str] = &[];
            const CATEGORIES: &'static [$crate::__private::CategoryDeclaration] = &[];
            const COMMANDS: &'static [$crate::__private::CommandDeclaration] = &[];
            const PARAMETERS: &'static [$crate::__private::ParameterDeclaration] = &[];
            const ISLANDS: &'static [$crate::__private::IslandOf<()>] = &[];
            const BOUND_OPTIONS: &'static [(usize, &'static str, usize)] = &[];
            type Topics = ();
            type Wiring = ();
            fn options() -> $crate::__private::OptionsList {
                ::core::default::Default::default()
            }
            fn topics() {}
            fn wire(_: (), _: &$crate::__private::OptionsList, _: &$crate::__private::Assembly) {}
            fn sources(_: &$crate::__private::Arc<()>) -> $crate::__private::Sources {
                ::core::default::Default::default()
            }
            fn wired_topics(_: &()) -> &() {
                &()
            }
            fn topic(_: &(), _: usize) -> ::core::option::Option<&dyn $crate::__private::AnyTopic> {
                ::core::option::Option::None
            }
            fn actuator(_: &(), _: usize) -> ::core::option::Option<&dyn $crate::__private::AnyActuator> {
                ::core::option::Option::None
            }
            fn commands(_: &$crate::__private::OptionsList) -> ::std::vec::Vec<$crate::__private::Prepared> {
                ::std::vec::Vec::new()
            }
        }
    };
}
