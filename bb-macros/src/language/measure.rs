//! The quantity of a number in the language, and its bounds.

use super::JointKind;
use crate::units::Dimension;

/// A dimension, or one that depends on the kind of the enclosing joint.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Measure {
    Of(Dimension),
    Position,
    Velocity,
    /// A force or a torque.
    Effort,
    Damping,
}

impl Measure {
    /// The dimension and an example, if it depends on the joint. `None` outside of joints and for a fixed joint,
    /// where the number itself is reported by another rule.
    pub(crate) fn in_joint(self, joint: Option<JointKind>) -> Option<(Dimension, Option<&'static str>)> {
        if let Self::Of(dimension) = self {
            return Some((dimension, None));
        }
        let (dimension, example) = match (self, joint?) {
            (_, JointKind::Fixed) => return None,
            (Self::Position, kind) if kind.turns() => (Dimension::ANGLE, "90 deg"),
            (Self::Velocity, kind) if kind.turns() => (Dimension::ANGULAR_VELOCITY, "60 deg/s"),
            (Self::Effort, kind) if kind.turns() => (Dimension::TORQUE, "5 N*m"),
            (Self::Damping, kind) if kind.turns() => (Dimension::ANGULAR_DAMPING, "0.1 N*m*s/rad"),
            (Self::Position, _) => (Dimension::LENGTH, "0.1 m"),
            (Self::Velocity, _) => (Dimension::VELOCITY, "0.1 m/s"),
            (Self::Effort, _) => (Dimension::FORCE, "5 N"),
            (Self::Damping, _) => (Dimension::LINEAR_DAMPING, "0.1 N*s/m"),
            (Self::Of(dimension), _) => (dimension, ""),
        };
        Some((dimension, Some(example)))
    }
}

/// The allowed numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Bounds {
    Any,
    /// A number used as a divisor.
    NotZero,
    /// Greater than 0.
    Positive,
    /// A time that fits in nanoseconds.
    Time,
    /// A frequency whose period fits in nanoseconds.
    Rate,
}

/// A period beyond it is less than a nanosecond.
const HIGHEST_RATE_HZ: f64 = 1e9;
/// 292 years: longer times do not fit in nanoseconds.
const LONGEST_TIME_S: f64 = 9.2e9;

impl Bounds {
    /// The fault of a number, in SI.
    pub(crate) fn fault(self, value: f64) -> Option<&'static str> {
        let fault = match self {
            Self::Any => return None,
            Self::NotZero if value == 0.0 => "this must not be 0",
            Self::Positive | Self::Time | Self::Rate if value <= 0.0 => "this must be more than 0",
            Self::Time if value > LONGEST_TIME_S => "this must be at most 292 years",
            Self::Rate if value > HIGHEST_RATE_HZ => "this must be at most 1 GHz",
            Self::Rate if 1.0 / value > LONGEST_TIME_S => {
                "this rate is too low; it must be more than once in 292 years"
            }
            Self::NotZero | Self::Positive | Self::Time | Self::Rate => return None,
        };
        Some(fault)
    }
}
