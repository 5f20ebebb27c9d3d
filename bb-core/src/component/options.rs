//! Typed options with defaults, ranges, units and docs.

use super::{OptionField, Setting};
use std::any::Any;

/// The options of a sensor or an estimator: a plain struct, filled from the parentheses in `robot!`.
///
/// Derive it. Every field has either a default or is `required` (its type then implements `Default`, whose value is
/// used until one is given). A field may be of any type. An `f64`, an `f32`, a `Duration` or an `Option` of one of
/// these may state a unit: a literal in `robot!` must then have a unit of that dimension, and is converted to SI; a
/// `Duration` is always a time. A number may state a range, and a literal must be within it. Other values, such as
/// constants, are passed unchanged and validated at the start.
///
/// ```
/// use bb_core::prelude::*;
///
/// /// Options of a range finder.
/// #[derive(Clone, Debug, Options)]
/// pub struct RangeFinderOptions {
///     /// Device file.
///     #[option(required)]
///     pub port: String,
///     /// Readings beyond it are dropped. Unit: m.
///     #[option(default = 4.0, range = 0.1..=30.0, unit = "m")]
///     pub maximum_range: f64,
///     /// How long a reading may take. In `robot!` it is written with a unit, `timeout = 20 ms`; here it is a Rust value.
///     #[option(default = Duration::from_millis(50))]
///     pub timeout: Duration,
/// }
///
/// assert_eq!(RangeFinderOptions::defaults().maximum_range, 4.0);
/// assert!(RangeFinderOptions { maximum_range: 99.0, ..RangeFinderOptions::defaults() }.validate().is_err());
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not an options struct",
    label = "cannot be the options of a component",
    note = "derive it: `#[derive(Clone, Debug, Options)]`, with `#[option(default = …)]` on each field"
)]
pub trait Options: Clone + std::fmt::Debug + Send + 'static {
    /// The description of each option, in the order of the fields.
    const FIELDS: &'static [OptionField];

    /// All defaults; a required option has its type's `Default`.
    fn defaults() -> Self;

    /// Checks every range. The error names the option, its value and what is accepted.
    fn validate(&self) -> Result<(), String>;

    /// The option number `index` of [`Options::FIELDS`], for settings that are read at run time.
    #[doc(hidden)]
    fn setting(&mut self, _index: usize) -> Option<Box<dyn Setting + '_>> {
        None
    }
}

/// The options of a component without options.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoOptions;

impl Options for NoOptions {
    const FIELDS: &'static [OptionField] = &[];
    fn defaults() -> Self {
        Self
    }
    fn validate(&self) -> Result<(), String> {
        Ok(())
    }
}

/// The options of all components of a robot, by the number of the component.
#[allow(missing_debug_implementations)]
#[derive(Default)]
pub struct OptionsList(Vec<Box<dyn AnyOptions>>);

impl OptionsList {
    /// Adds those of the next component.
    pub fn add<O: Options>(&mut self, options: O) {
        self.0.push(Box::new(options));
    }

    /// Returns the options of a component.
    pub(crate) fn any(&mut self, component: usize) -> Option<&mut dyn AnyOptions> {
        self.0.get_mut(component).map(Box::as_mut)
    }

    /// Returns the options of a component, in the type that the expansion knows them to be of.
    pub(crate) fn of<O: 'static>(&self, component: usize) -> &O {
        let options: Option<&dyn Any> = self.0.get(component).map(|options| &**options as &dyn Any);
        options.and_then(<dyn Any>::downcast_ref).unwrap_or_else(unverified)
    }

    /// Returns the options of a component to be changed, in the type that the expansion knows them to be of.
    pub(crate) fn of_mut<O: 'static>(&mut self, component: usize) -> &mut O {
        let options = self.any(component).map(|options| options as &mut dyn Any);
        options.and_then(<dyn Any>::downcast_mut).unwrap_or_else(unverified)
    }
}

/// Panics for a value that only a robot that failed to verify does not have.
#[allow(clippy::panic, reason = "such a robot does not compile")]
pub(crate) fn unverified<T>() -> T {
    panic!("this robot did not verify")
}

/// The options of one component, whatever its type.
pub(crate) trait AnyOptions: Any + Send {
    /// Returns the fields, see [`Options::FIELDS`].
    fn fields(&self) -> &'static [OptionField];
    /// The option number `index` of [`AnyOptions::fields`].
    fn setting(&mut self, index: usize) -> Option<Box<dyn Setting + '_>>;
    /// Validates the options, see [`Options::validate`].
    fn validate(&self) -> Result<(), String>;
    /// A copy, to be changed and put back by [`AnyOptions::replace`].
    fn copy(&self) -> Box<dyn AnyOptions>;
    /// Takes over a copy.
    fn replace(&mut self, copy: Box<dyn AnyOptions>);
}

impl<O: Options> AnyOptions for O {
    fn fields(&self) -> &'static [OptionField] {
        O::FIELDS
    }

    fn setting(&mut self, index: usize) -> Option<Box<dyn Setting + '_>> {
        Options::setting(self, index)
    }

    fn validate(&self) -> Result<(), String> {
        Options::validate(self)
    }

    fn copy(&self) -> Box<dyn AnyOptions> {
        Box::new(self.clone())
    }

    fn replace(&mut self, copy: Box<dyn AnyOptions>) {
        let copy: Box<dyn Any> = copy;
        if let Ok(copy) = copy.downcast() {
            *self = *copy;
        }
    }
}
