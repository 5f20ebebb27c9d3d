//! Commands to the actuator of a joint, and the limits applied to them.

use super::Transmission;
use std::fmt;

/// The bounds applied to a joint's commands, and the joint's position. Rad, rad/s and N·m where it turns; m, m/s and
/// N where it slides. A bound that is not declared is infinite.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct JointBounds {
    /// The name of the joint.
    pub joint: &'static str,
    /// The smallest position.
    pub lower: f64,
    /// The largest position.
    pub upper: f64,
    /// The largest speed.
    pub velocity: f64,
    /// The largest torque or force.
    pub effort: f64,
    /// The position, if it is known and not stale.
    pub position: Option<f64>,
}

/// The quantities in which a command exceeded a bound and was clamped to it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Exceeded {
    /// A position.
    pub position: bool,
    /// A velocity.
    pub velocity: bool,
    /// An effort.
    pub effort: bool,
}

/// A quantity for which a joint has limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LimitedQuantity {
    /// rad or m.
    Position,
    /// rad/s or m/s.
    Velocity,
    /// N·m or N.
    Effort,
}

/// A command that is not carried out: it leads beyond a limit and cannot be clamped to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutOfBounds {
    /// The quantity.
    pub quantity: LimitedQuantity,
    /// The commanded value.
    pub value: f64,
    /// The bound that it exceeds.
    pub bound: f64,
}

/// A payload that commands a joint, and declares so with `#[payload(joint_command)]`: the runtime applies the limits
/// of the joint before the actuator gets it.
///
/// ```
/// use bb_core::prelude::*;
/// use bb_core::{Exceeded, JointBounds, JointCommand, OutOfBounds};
///
/// /// A command to a gripper.
/// #[derive(Clone, Debug, Payload)]
/// #[payload(joint_command)]
/// pub struct Grip {
///     /// m
///     pub width: f64,
///     /// N
///     pub force: f64,
/// }
///
/// impl JointCommand for Grip {
///     fn limit(&mut self, bounds: &JointBounds) -> Result<Exceeded, OutOfBounds> {
///         let mut exceeded = Exceeded::default();
///         bounds.hold_position(&mut self.width, &mut exceeded);
///         bounds.hold_effort(&mut self.force, &mut exceeded);
///         Ok(exceeded)
///     }
/// }
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` does not say how it is held to the limits of a joint",
    label = "no `JointCommand`",
    note = "`#[payload(joint_command)]` promises it; implement `bb_core::JointCommand` for it"
)]
pub trait JointCommand: Sized {
    /// Clamps values that exceed the bounds, and returns which did.
    ///
    /// # Errors
    /// Clamping would make it another motion: it is not carried out.
    fn limit(&mut self, bounds: &JointBounds) -> Result<Exceeded, OutOfBounds>;

    /// The command that stops the joint, if there is one: sent when a `Command` that moves the joint is
    /// cancelled.
    ///
    /// [`ActuatorCommand`](crate::payload::ActuatorCommand), [`VelocityCommand`](crate::payload::VelocityCommand) and
    /// [`EffortCommand`](crate::payload::EffortCommand) have one. [`PositionCommand`](crate::payload::PositionCommand) and
    /// [`JointTrajectory`](crate::payload::JointTrajectory) have none: the joint goes on to the last target, and rests there.
    fn stop() -> Option<Self> {
        None
    }

    /// Converts the command to the motor of `joint`, on the other side of its transmission: for an actuator with
    /// `SIDE = JointSide::Motor`. `None`, the default, if that is not defined: the actuator then cannot be at a
    /// joint with a transmission.
    fn at_motor(&self, joint: &str, transmission: &Transmission) -> Option<Self> {
        let _ = (joint, transmission);
        None
    }
}

impl JointBounds {
    /// No bounds at all, of no joint, at an unknown position.
    pub const NONE: Self = Self {
        joint: "",
        lower: f64::NEG_INFINITY,
        upper: f64::INFINITY,
        velocity: f64::INFINITY,
        effort: f64::INFINITY,
        position: None,
    };

    /// Clamps a position to the limits.
    pub fn hold_position(&self, position: &mut f64, exceeded: &mut Exceeded) {
        exceeded.position |= hold(position, self.lower, self.upper);
    }

    /// Clamps a velocity to the limits. At the end of its range, a joint does not move further out: the velocity is
    /// then zero.
    pub fn hold_velocity(&self, velocity: &mut f64, exceeded: &mut Exceeded) {
        exceeded.velocity |= hold(velocity, -self.velocity, self.velocity);
        let leads_out = match self.position {
            Some(position) if *velocity > 0.0 => position >= self.upper,
            Some(position) if *velocity < 0.0 => position <= self.lower,
            _ => false,
        };
        if leads_out {
            *velocity = 0.0;
            exceeded.position = true;
        }
    }

    /// Clamps a torque or force to the limits.
    pub fn hold_effort(&self, effort: &mut f64, exceeded: &mut Exceeded) {
        exceeded.effort |= hold(effort, -self.effort, self.effort);
    }

    /// Checks a position against the limits.
    ///
    /// # Errors
    /// The position exceeds the limits by more than rounding explains.
    pub fn check_position(&self, position: f64) -> Result<(), OutOfBounds> {
        check(LimitedQuantity::Position, position, self.lower, self.upper)
    }

    /// Checks a velocity against the limits.
    ///
    /// # Errors
    /// The velocity exceeds the limits by more than rounding explains.
    pub fn check_velocity(&self, velocity: f64) -> Result<(), OutOfBounds> {
        check(LimitedQuantity::Velocity, velocity, -self.velocity, self.velocity)
    }

    /// Checks a torque or force against the limits.
    ///
    /// # Errors
    /// The torque or force exceeds the limits by more than rounding explains.
    pub fn check_effort(&self, effort: f64) -> Result<(), OutOfBounds> {
        check(LimitedQuantity::Effort, effort, -self.effort, self.effort)
    }
}

impl Exceeded {
    /// Returns whether the command exceeded anything.
    pub fn any(self) -> bool {
        self.position || self.velocity || self.effort
    }

    /// The quantities exceeded.
    pub fn quantities(self) -> impl Iterator<Item = LimitedQuantity> {
        let all = [
            (self.position, LimitedQuantity::Position),
            (self.velocity, LimitedQuantity::Velocity),
            (self.effort, LimitedQuantity::Effort),
        ];
        all.into_iter().filter(|(is_exceeded, _)| *is_exceeded).map(|(_, quantity)| quantity)
    }
}

impl LimitedQuantity {
    /// All of them.
    pub const ALL: &'static [Self] = &[Self::Position, Self::Velocity, Self::Effort];

    /// Returns the name for people.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Position => "position",
            Self::Velocity => "velocity",
            Self::Effort => "effort",
        }
    }
}

impl fmt::Display for LimitedQuantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl fmt::Display for OutOfBounds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { quantity, value, bound } = self;
        write!(f, "the {quantity} {value} is beyond the limit {bound} of the joint")
    }
}

impl std::error::Error for OutOfBounds {}

/// Clamps a value to its bounds; returns whether it was outside.
fn hold(value: &mut f64, lower: f64, upper: f64) -> bool {
    let held = value.max(lower).min(upper);
    let is_outside = held != *value;
    *value = held;
    is_outside
}

/// The relative rounding error of a value at a bound.
const ROUNDING: f64 = 1e-9;

fn check(quantity: LimitedQuantity, value: f64, lower: f64, upper: f64) -> Result<(), OutOfBounds> {
    let beyond = |bound: f64| (value - bound).abs() > ROUNDING * bound.abs().max(1.0);
    match value {
        value if value > upper && beyond(upper) => Err(OutOfBounds { quantity, value, bound: upper }),
        value if value < lower && beyond(lower) => Err(OutOfBounds { quantity, value, bound: lower }),
        _ => Ok(()),
    }
}
