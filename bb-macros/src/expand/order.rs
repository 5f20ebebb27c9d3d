//! The order of events that are due at the same instant, so that every estimator gets the newest of all its inputs.

use crate::model::{EstimatorId, From, PublisherId, Robot, SensorId, Table, Trigger};
use crate::verify::Verified;

/// The number of estimators on the longest path from each one to a sensor. Consumers of one publisher are called in
/// this order: one that also takes another's output for the same message comes after it.
pub(super) fn depths(verified: &Verified<'_>) -> Table<EstimatorId, usize> {
    let mut known = verified.robot.estimators.map(|_| None);
    verified.robot.estimators.map(|id| depth(verified, id, &mut known))
}

fn depth(verified: &Verified<'_>, id: EstimatorId, known: &mut Table<EstimatorId, Option<usize>>) -> usize {
    if let Some(known) = known[id] {
        return known;
    }
    let mut deepest = 0;
    for source in &verified.sources[id] {
        if let From::Estimator(above, _) = verified.robot.publishers[*source].from {
            deepest = deepest.max(depth(verified, above, known) + 1);
        }
    }
    known[id] = Some(deepest);
    deepest
}

/// The sensors in the order in which they are read when several are due at once: a sensor whose message triggers an
/// estimator is read after the estimator's other sensors. Otherwise, and in a cycle, by declaration.
pub(super) fn sensors(verified: &Verified<'_>) -> Vec<SensorId> {
    let robot = verified.robot;
    let mut before: Table<SensorId, Vec<SensorId>> = robot.sensors.map(|_| Vec::new());
    for (estimator, sources) in robot.estimators.iter().zip(&verified.sources) {
        let driver = estimator.inputs.iter().zip(sources).find(|(input, _)| input.driver.is_some());
        let Some(driver) = driver.and_then(|(_, source)| trigger(robot, *source)) else { continue };
        let others = sources.iter().filter_map(|source| trigger(robot, *source)).filter(|other| *other != driver);
        before[driver].extend(others);
    }
    let mut order: Vec<SensorId> = Vec::new();
    let mut left: Vec<SensorId> = robot.sensors.ids().collect();
    while !left.is_empty() {
        let is_free = |id: &SensorId| before[*id].iter().all(|other| !left.contains(other));
        // In a cycle none is free; the first goes first.
        let next = left.iter().position(is_free).unwrap_or_default();
        order.push(left.remove(next));
    }
    order
}

/// The sensor whose message triggers this publisher.
fn trigger(robot: &Robot, publisher: PublisherId) -> Option<SensorId> {
    match robot.trigger(publisher)? {
        Trigger::Sensor(id) => Some(id),
        Trigger::Service(_) => None,
    }
}
