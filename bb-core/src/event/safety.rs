//! Safety of the robot: its permission to move.

use crate::message::Payload;
use std::fmt;

/// Safety state: whether the robot may move.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Payload)]
pub enum Safety {
    /// Motion is inhibited.
    #[default]
    Disarmed,
    /// Motion is enabled.
    Armed,
    /// Motion is inhibited, and the disarm callbacks run.
    Disarming,
    /// Something could not be made safe, or panicked too often; only a forced disarm leaves this state.
    Error,
}

impl fmt::Display for Safety {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Disarmed => "disarmed",
            Self::Armed => "armed",
            Self::Disarming => "disarming",
            Self::Error => "error",
        })
    }
}

/// A change of the safety state, published at `safety`.
#[derive(Clone, Debug, PartialEq, Eq, Payload)]
#[non_exhaustive]
pub struct SafetyTransition {
    /// The previous state.
    pub from: Safety,
    /// The new state.
    pub to: Safety,
    /// Caller that armed, disarmed or stopped the robot, or started the command that did, named as in
    /// [`CommandEvent`](super::CommandEvent); `None` if hardware reported an error.
    pub caller: Option<String>,
}

/// Reason for the safety state `error`, published at `safety/error`.
#[derive(Clone, Debug, PartialEq, Payload)]
pub struct SafetyError {
    /// The component.
    pub path: &'static str,
    /// Error of the hardware.
    pub error: HardwareError,
}

impl fmt::Display for SafetyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "`{}`: {}", self.path, self.error)
    }
}

/// Danger from hardware: a kind and a quantity for programs, a text for people. A text alone converts to one.
///
/// ```
/// use bb_core::event::{HardwareError, HardwareErrorKind, Quantity};
///
/// let plain = HardwareError::from("the bus is silent");
/// assert_eq!((plain.kind, plain.quantity), (HardwareErrorKind::Unspecified, None));
///
/// let hot = HardwareError::new(HardwareErrorKind::Overheating, "the winding").with_quantity(85.0, "degC");
/// assert_eq!(hot.to_string(), "the winding (overheating: 85 degC)");
/// match (hot.kind, hot.quantity) {
///     (HardwareErrorKind::Overheating, Some(Quantity { value, .. })) => assert!(value > 80.0),
///     _ => unreachable!(),
/// }
/// ```
#[derive(Clone, Debug, PartialEq, Payload)]
#[non_exhaustive]
pub struct HardwareError {
    /// Kind of danger.
    pub kind: HardwareErrorKind,
    /// The quantity that shows it.
    pub quantity: Option<Quantity>,
    /// Description for people.
    pub message: String,
}

impl HardwareError {
    /// An error of that kind.
    pub fn new(kind: HardwareErrorKind, message: impl Into<String>) -> Self {
        Self { kind, quantity: None, message: message.into() }
    }

    /// Adds the quantity that shows it; `unit` is a text, such as `degC`, or empty.
    pub fn with_quantity(self, value: f64, unit: &'static str) -> Self {
        Self { quantity: Some(Quantity { value, unit }), ..self }
    }
}

impl<T: Into<String>> From<T> for HardwareError {
    fn from(message: T) -> Self {
        Self::new(HardwareErrorKind::Unspecified, message)
    }
}

impl fmt::Display for HardwareError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { kind, quantity, message } = self;
        f.write_str(message)?;
        match (kind, quantity) {
            (HardwareErrorKind::Unspecified, None) => Ok(()),
            (HardwareErrorKind::Unspecified, Some(quantity)) => write!(f, " ({quantity})"),
            (kind, None) => write!(f, " ({kind})"),
            (kind, Some(quantity)) => write!(f, " ({kind}: {quantity})"),
        }
    }
}

/// A kind of danger, to match on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Payload)]
#[non_exhaustive]
pub enum HardwareErrorKind {
    /// A danger that only the text describes.
    #[default]
    Unspecified,
    /// Too hot.
    Overheating,
    /// Too much current flows.
    Overcurrent,
    /// The voltage is too high.
    Overvoltage,
    /// The voltage is too low.
    Undervoltage,
    /// The load, force or torque is too great.
    Overload,
    /// Blocked: it does not move, or not as commanded.
    Blocked,
    /// Outside of its range, or a limit switch was hit.
    OutOfRange,
    /// No answer, or an answer that makes no sense.
    Communication,
    /// A disarm callback failed or did not return in time.
    NotMadeSafe,
    /// Code that panicked too often.
    Panics,
    /// A kind of the component's own.
    Other(&'static str),
}

impl HardwareErrorKind {
    /// Name of the kind: `overheating`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Unspecified => "unspecified",
            Self::Overheating => "overheating",
            Self::Overcurrent => "overcurrent",
            Self::Overvoltage => "overvoltage",
            Self::Undervoltage => "undervoltage",
            Self::Overload => "overload",
            Self::Blocked => "blocked",
            Self::OutOfRange => "out of range",
            Self::Communication => "communication",
            Self::NotMadeSafe => "not made safe",
            Self::Panics => "panics",
            Self::Other(name) => name,
        }
    }
}

impl fmt::Display for HardwareErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A number with its unit.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub struct Quantity {
    /// The number.
    pub value: f64,
    /// The unit; empty without one.
    pub unit: &'static str,
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { value, unit } = self;
        write!(f, "{value}")?;
        if unit.is_empty() { Ok(()) } else { write!(f, " {unit}") }
    }
}
