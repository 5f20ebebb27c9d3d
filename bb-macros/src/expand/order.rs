//! In which order what is due at one instant happens, so that every estimator gets the newest of all its inputs.

use crate::model::{EstimatorId, From, PublisherId, Robot, SensorId, Trigger};
use crate::verify::Verified;

/// How many estimators stand above each one on the longest way to a sensor. Consumers of one publisher are called in
/// this order: one that also takes what another makes of the same message comes after it.
pub(super) fn depths(verified: &Verified<'_>) -> Vec<usize> {
    let mut depths = vec![None; verified.robot.estimators.len()];
    (0..depths.len()).map(|id| depth(verified, id, &mut depths)).collect()
}

fn depth(verified: &Verified<'_>, id: EstimatorId, depths: &mut [Option<usize>]) -> usize {
    if let Some(Some(known)) = depths.get(id) {
        return *known;
    }
    let above = verified.sources.get(id).into_iter().flatten().filter_map(|source| {
        match verified.robot.publishers.get(*source)?.from {
            From::Estimator(above, _) => Some(depth(verified, above, depths) + 1),
            From::Sensor(_) | From::Service(_) => None,
        }
    });
    let deepest = above.max().unwrap_or(0);
    if let Some(slot) = depths.get_mut(id) {
        *slot = Some(deepest);
    }
    deepest
}

/// The sensors in the order in which they are read when several are due at once: one whose message makes an estimator
/// run comes after those that the estimator takes besides it. Otherwise, and round a circle, by declaration.
pub(super) fn sensors(verified: &Verified<'_>) -> Vec<SensorId> {
    let robot = verified.robot;
    let mut before: Vec<Vec<SensorId>> = vec![Vec::new(); robot.sensors.len()];
    for (estimator, sources) in robot.estimators.iter().zip(&verified.sources) {
        let driver = estimator.inputs.iter().zip(sources).find(|(input, _)| input.driver.is_some());
        let Some(driver) = driver.and_then(|(_, source)| trigger(robot, *source)) else { continue };
        let others = sources.iter().filter_map(|source| trigger(robot, *source)).filter(|other| *other != driver);
        if let Some(list) = before.get_mut(driver) {
            list.extend(others);
        }
    }
    let mut order: Vec<SensorId> = Vec::new();
    let mut left: Vec<SensorId> = (0..robot.sensors.len()).collect();
    while !left.is_empty() {
        let is_free =
            |id: &SensorId| before.get(*id).is_none_or(|list| list.iter().all(|other| !left.contains(other)));
        let next = left.iter().position(is_free).unwrap_or(0);
        order.push(left.remove(next));
    }
    order
}

/// The sensor whose message makes this publisher publish.
fn trigger(robot: &Robot, publisher: PublisherId) -> Option<SensorId> {
    match robot.trigger(publisher)? {
        Trigger::Sensor(id) => Some(id),
        Trigger::Service(_) => None,
    }
}
