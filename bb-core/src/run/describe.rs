//! A robot's description, one fact a line. A journal begins with it, and a journal of another robot is refused.

use crate::control::Control;
use crate::declaration::RobotDeclaration;
use crate::pubsub::AnyTopic;

/// The declaration, and the values of parameters.
pub(super) fn describe(robot: &RobotDeclaration, topics: &[&dyn AnyTopic], control: &Control) -> Vec<String> {
    let mut facts = vec![format!("robot {}", robot.name)];
    facts.extend(topics.iter().map(|topic| format!("{} publishes {}", topic.path(), topic.payload_name())));
    for declared in robot.estimators {
        let inputs: Vec<_> =
            declared.inputs.iter().map(|input| (input.source, input.driver, input.optional)).collect();
        let tolerances: Vec<_> =
            declared.inputs.iter().map(|input| (input.tolerance_nanos, input.stale_after_nanos)).collect();
        facts.push(format!(
            "{}: island {}, supervisor {}, inputs {inputs:?}, tolerances {tolerances:?}, {:?}",
            declared.path, declared.island, declared.supervisor, declared.health
        ));
    }
    facts.extend(robot.actuators.iter().map(|declared| format!("{} moves {}", declared.path, declared.joint)));
    facts.push(format!("states {:?}", robot.states));
    facts.extend(robot.categories.iter().map(|category| format!("{category:?}")));
    facts.extend(robot.commands.iter().map(|declared| format!("{declared:?}")));
    let parameters = control.parameters();
    facts.extend(
        robot
            .parameters
            .iter()
            .zip(parameters.all())
            .map(|(declared, value)| format!("{} = {value}", declared.path)),
    );
    facts
}

/// The first fact in which two robots differ: the journal's line, and this robot's.
pub(super) fn difference(journal: &[String], own: &[String]) -> Option<String> {
    let longest = journal.len().max(own.len());
    let differs = (0..longest).find(|index| journal.get(*index) != own.get(*index))?;
    let text =
        |facts: &[String]| facts.get(differs).map_or_else(|| "nothing more".to_owned(), |fact| format!("`{fact}`"));
    Some(format!("the journal is of another robot: it says {}, and this robot has {}", text(journal), text(own)))
}
