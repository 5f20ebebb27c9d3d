//! No estimator depends on itself, directly or round a cycle.
//!
//! Wrong: `estimator a: A() { input b: estimator::base::b; } estimator b: B() { input a: estimator::base::a; }`

use crate::diagnostics::Diagnostics;
use crate::model::{EstimatorId, From, Robot};

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    let mut state = vec![State::New; robot.estimators.len()];
    for id in 0..robot.estimators.len() {
        visit(robot, id, &mut state, &mut Vec::new(), diagnostics);
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum State {
    New,
    /// On the path that is being followed.
    Open,
    Done,
}

/// Follows the inputs of an estimator to the estimators that publish them; one that is open already closes a cycle.
fn visit(
    robot: &Robot,
    id: EstimatorId,
    state: &mut [State],
    path: &mut Vec<EstimatorId>,
    diagnostics: &mut Diagnostics,
) {
    let (Some(estimator), Some(State::New)) = (robot.estimators.get(id), state.get(id)) else {
        return;
    };
    state[id] = State::Open;
    path.push(id);
    for input in &estimator.inputs {
        let publisher = input.source.and_then(|source| robot.publishers.get(source));
        let Some(From::Estimator(source, _)) = publisher.map(|publisher| publisher.from) else {
            continue;
        };
        if state.get(source) == Some(&State::Open) {
            let start = path.iter().position(|open| *open == source).unwrap_or(0);
            let name = &estimator.name;
            let message = if source == id {
                format!("`{name}` takes what it publishes; name another publisher")
            } else {
                // The path leads from consumer to publisher; messages flow the other way.
                let cycle = cycle(robot, path.iter().skip(start).rev().copied());
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
fn cycle(robot: &Robot, estimators: impl Iterator<Item = EstimatorId>) -> String {
    let names: Vec<String> =
        estimators.filter_map(|id| Some(format!("`{}`", robot.estimators.get(id)?.name))).collect();
    names.iter().chain(names.first()).cloned().collect::<Vec<_>>().join(" → ")
}
