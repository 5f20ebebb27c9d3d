//! Commands as declared.

/// Effect of a command on the robot's safety when it succeeds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Role {
    /// Nothing.
    #[default]
    Plain,
    /// Arms the robot.
    Arming,
    /// Disarms the robot: all other commands are cancelled, and the disarm callbacks run.
    Disarming,
}

impl Role {
    /// Returns the name in JSON: `plain`, `arming` or `disarming`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Plain => "plain",
            Self::Arming => "arming",
            Self::Disarming => "disarming",
        }
    }
}

/// A command as declared.
#[derive(Clone, Copy, Debug)]
pub struct CommandDeclaration {
    /// Name.
    pub name: &'static str,
    /// Path: `command/stop`.
    pub path: &'static str,
    /// The states in which it may start; `None` for the default of its role.
    pub allowed_states: Option<&'static [&'static str]>,
    /// Longest time that an execution may take, in nanoseconds.
    pub timeout_nanos: Option<i64>,
    /// The number of its category.
    pub category: usize,
    /// Commands that it cancels when it starts.
    pub cancel: Cancel,
}

/// Commands that a command cancels when it starts.
#[derive(Clone, Copy, Debug)]
pub enum Cancel {
    /// Nothing.
    Nothing,
    /// Every running command.
    All,
    /// The commands that run in these categories.
    Categories(&'static [usize]),
}

impl Cancel {
    pub(crate) fn includes(self, category: usize) -> bool {
        match self {
            Self::Nothing => false,
            Self::All => true,
            Self::Categories(categories) => categories.contains(&category),
        }
    }
}

impl CommandDeclaration {
    /// Returns whether the command may start in a state. By default, arming commands start in `disarmed`, disarming ones in every other
    /// state, and the rest when the robot is `idle`.
    pub(crate) fn allowed(&self, role: Role, state: &str) -> bool {
        match (self.allowed_states, role) {
            (Some(states), _) => states.contains(&state),
            (None, Role::Plain) => state == "idle",
            (None, Role::Arming) => state == "disarmed",
            (None, Role::Disarming) => state != "disarmed",
        }
    }
}
