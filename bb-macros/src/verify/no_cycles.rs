//! No estimator depends on itself, directly or through a cycle.
//!
//! Wrong: `estimator a: A() { input b: estimator::base::b; } estimator b: B() { input a: estimator::base::a; }`

use crate::diagnostics::Diagnostics;
use crate::model::{EstimatorId, From, Robot, Table};

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    let mut state = robot.estimators.map(|_| State::New);
    for id in robot.estimators.ids() {
        visit(robot, id, &mut state, &mut Vec::new(), diagnostics);
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum State {
    New,
    /// Visited and on the current path.
    Open,
    Done,
}

/// Follows the inputs of an estimator to the estimators that publish them; reaching one that is already open closes a
/// cycle.
fn visit(
    robot: &Robot,
    id: EstimatorId,
    state: &mut Table<EstimatorId, State>,
    path: &mut Vec<EstimatorId>,
    diagnostics: &mut Diagnostics,
) {
    if state[id] != State::New {
        return;
    }
    let estimator = &robot.estimators[id];
    state[id] = State::Open;
    path.push(id);
    for input in &estimator.inputs {
        let publisher = input.source.map(|source| &robot.publishers[source]);
        let Some(From::Estimator(source, _)) = publisher.map(|publisher| publisher.from) else {
            continue;
        };
        if state[source] == State::Open {
            let name = &estimator.name;
            let message = if source == id {
                format!("`{name}` takes what it publishes; name another publisher")
            } else {
                // The path goes from consumer to publisher; messages flow the other way.
                let cycle = cycle(robot, path.iter().skip_while(|open| **open != source).copied().collect());
                format!("`{name}` depends on itself: {cycle}; leave out one of these inputs")
            };
            diagnostics.at(input.path.place(), message);
        } else {
            visit(robot, source, state, path, diagnostics);
        }
    }
    path.pop();
    state[id] = State::Done;
}

/// `` `a` → `b` → `a` ``, in the direction in which messages flow.
fn cycle(robot: &Robot, against_the_flow: Vec<EstimatorId>) -> String {
    let estimators = against_the_flow.into_iter().rev();
    let names: Vec<String> = estimators.map(|id| format!("`{}`", robot.estimators[id].name)).collect();
    names.iter().chain(names.first()).cloned().collect::<Vec<_>>().join(" → ")
}
