//! The operational state: `disarmed`, a declared state, or `idle`, which is `executing` while a command runs.

use crate::event::Safety;

/// Motion is inhibited.
pub(super) const DISARMED: &str = "disarmed";
/// Armed, and no command runs.
pub(super) const IDLE: &str = "idle";
/// Armed, and a command runs.
pub(super) const EXECUTING: &str = "executing";

/// The parts of the operational state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Machine {
    pub(super) safety: Safety,
    /// The state while no command runs.
    pub(super) resting: &'static str,
    /// Number of running commands.
    pub(super) running: usize,
}

impl Default for Machine {
    fn default() -> Self {
        Self { safety: Safety::Disarmed, resting: IDLE, running: 0 }
    }
}

impl Machine {
    /// Returns the name of the state.
    pub(super) fn state(&self) -> &'static str {
        match self.safety {
            Safety::Armed if self.running > 0 && self.resting == IDLE => EXECUTING,
            Safety::Armed => self.resting,
            Safety::Disarmed | Safety::Disarming | Safety::Error => DISARMED,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn idle_becomes_executing_while_commands_run_and_a_declared_state_stays() {
        let mut machine = Machine::default();
        assert_eq!(machine.state(), "disarmed");
        machine.running = 1;
        assert_eq!(machine.state(), "disarmed", "the command that arms runs while it is disarmed");
        machine.safety = Safety::Armed;
        assert_eq!(machine.state(), "executing");
        machine = Machine { running: 0, resting: "degraded", ..machine };
        assert_eq!(machine.state(), "degraded");
        machine.running = 1;
        assert_eq!(machine.state(), "degraded", "a declared state is never hidden");
    }
}
