//! The topics that every robot has.

use super::Declared;
use crate::event::{
    CommandEvent, ComponentFault, HealthTransition, ParameterChange, SafetyError, SafetyTransition, StateTransition,
};
use crate::journal::JournalLine;
use crate::pubsub::{AnyTopic, Registry, Topic};

/// The topics that every robot has.
#[derive(Debug)]
pub struct SystemTopics {
    pub(crate) state: Topic<StateTransition>,
    pub(crate) safety: Topic<SafetyTransition>,
    pub(crate) safety_error: Topic<SafetyError>,
    pub(crate) health: Topic<HealthTransition>,
    pub(crate) fault: Topic<ComponentFault>,
    pub(crate) journal: Topic<JournalLine>,
    pub(crate) commands: Box<[Topic<CommandEvent>]>,
    pub(crate) parameters: Box<[Topic<ParameterChange>]>,
    /// Topics created at run time.
    pub(crate) registry: Registry,
}

impl SystemTopics {
    pub(crate) fn new(declared: Declared) -> Self {
        Self {
            state: Topic::new("state_machine"),
            safety: Topic::new("safety"),
            safety_error: Topic::new("safety/error"),
            health: Topic::new("health"),
            fault: Topic::new("fault"),
            journal: Topic::new("journal"),
            commands: declared.commands.iter().map(|command| Topic::new(command.path)).collect(),
            parameters: declared.parameters.iter().map(|parameter| Topic::new(parameter.path)).collect(),
            registry: Registry::default(),
        }
    }

    pub(crate) fn all(&self) -> Vec<&dyn AnyTopic> {
        let fixed: [&dyn AnyTopic; 6] =
            [&self.state, &self.safety, &self.safety_error, &self.health, &self.fault, &self.journal];
        let commands = self.commands.iter().map(|topic| topic as &dyn AnyTopic);
        let parameters = self.parameters.iter().map(|topic| topic as &dyn AnyTopic);
        fixed.into_iter().chain(commands).chain(parameters).collect()
    }
}
