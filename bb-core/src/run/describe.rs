//! A robot's description, one fact a line. A journal begins with it, and a journal of another robot is refused.

use crate::control::Control;
use crate::declaration::RobotDeclaration;
use crate::pubsub::AnyTopic;

/// The declaration, and the values of parameters.
pub(super) fn describe(robot: &RobotDeclaration, topics: &[&dyn AnyTopic], control: &Control) -> Vec<String> {
    let mut facts = vec![format!("robot {}", robot.name)];
    for topic in topics {
        facts.push(format!("{} publishes {}", topic.path(), topic.payload_name()));
    }
    for declared in robot.estimators {
        let (mut inputs, mut tolerances) = (Vec::new(), Vec::new());
        for input in declared.inputs {
            inputs.push((input.source, input.driver, input.optional));
            tolerances.push((input.tolerance_nanos, input.stale_after_nanos));
        }
        facts.push(format!(
            "{}: island {}, supervisor {}, inputs {inputs:?}, tolerances {tolerances:?}, {:?}",
            declared.path, declared.island, declared.supervisor, declared.health
        ));
    }
    for declared in robot.actuators {
        facts.push(format!("{} moves {}", declared.path, declared.joint));
    }
    facts.push(format!("states {:?}", robot.states));
    for category in robot.categories {
        facts.push(format!("{category:?}"));
    }
    for declared in robot.commands {
        facts.push(format!("{declared:?}"));
    }
    for (declared, value) in robot.parameters.iter().zip(control.parameters().all()) {
        facts.push(format!("{} = {value}", declared.path));
    }
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
