//! Rights of a caller at a robot.

use crate::fault::Fault;
use std::fmt;

/// Something that a caller may do with a robot. Everybody may disarm it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Right {
    /// Subscribe to messages, and read parameters. Without it, `subscribe_any` selects nothing, and a description has no parameters. States, paths,
    /// commands, the graph and where the joints are need no right.
    Read,
    /// Set parameters.
    Parameters,
    /// Start commands. A command that arms needs [`Right::Arm`] too. A command that was started acts with all rights, like any component.
    Commands,
    /// Arm the robot, and force it out of the safety state `error`.
    Arm,
    /// Send commands to actuators.
    Actuators,
    /// Publish at paths of its own, and messages for external sensors and inputs: measurements that an estimator believes.
    Publish,
}

impl Right {
    /// All rights, one by one.
    pub const ALL: [Self; 6] =
        [Self::Read, Self::Parameters, Self::Commands, Self::Arm, Self::Actuators, Self::Publish];

    /// Name in errors, such as `parameters`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Read => "read",
            Self::Parameters => "parameters",
            Self::Commands => "commands",
            Self::Arm => "arm",
            Self::Actuators => "actuators",
            Self::Publish => "publish",
        }
    }
}

impl fmt::Display for Right {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A set of rights: `[Right::Read, Right::Commands].into()`.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
pub struct Rights(u8);

impl fmt::Debug for Rights {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_set().entries(Right::ALL.into_iter().filter(|right| self.contains(*right))).finish()
    }
}

impl Rights {
    /// None but to disarm.
    pub const NONE: Self = Self(0);
    /// All rights.
    pub const ALL: Self = Self((1 << Right::ALL.len()) - 1);

    /// Returns whether this right is among them.
    pub const fn contains(self, right: Right) -> bool {
        self.0 & 1 << right as u8 != 0
    }

    /// The right to read, and those named, separated by spaces, as the option `rights` of a bridge has them.
    ///
    /// # Errors
    /// A name is none of those `given`.
    pub fn parse(names: &str, given: &[Right]) -> Result<Self, Fault> {
        let right = |name: &str| {
            given.iter().find(|right| right.name() == name).copied().ok_or_else(|| {
                let names = given.iter().map(|right| format!("`{right}`")).collect::<Vec<_>>().join(", ");
                Fault::new(format!("`rights` has `{name}`: expected {names}"))
            })
        };
        std::iter::once(Ok(Right::Read)).chain(names.split_whitespace().map(right)).collect()
    }

    /// The rights that are in both sets.
    pub(crate) const fn and(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl<const N: usize> From<[Right; N]> for Rights {
    fn from(rights: [Right; N]) -> Self {
        rights.into_iter().collect()
    }
}

impl FromIterator<Right> for Rights {
    fn from_iter<I: IntoIterator<Item = Right>>(rights: I) -> Self {
        Self(rights.into_iter().fold(0, |all, right| all | 1 << right as u8))
    }
}

/// A right that a caller does not have.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Forbidden {
    /// Name of the caller.
    pub caller: String,
    /// The right that it lacks.
    pub right: Right,
}

impl fmt::Display for Forbidden {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "`{}` does not have the right `{}`", self.caller, self.right)
    }
}

impl std::error::Error for Forbidden {}
