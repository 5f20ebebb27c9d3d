//! Estimators that always run together, under one lock: see `bb_core::run::Island`.
//!
//! An estimator belongs to the island that feeds it, if all of its inputs come from there. An estimator fed by
//! several islands or sensors begins its own island, as does one with `runs_on: worker`.

use super::order;
use crate::model::{EstimatorId, From, Home, Id as _, PublisherId, Robot, Table, ids};
use crate::verify::Verified;
use std::collections::HashMap;

ids! { IslandId }

/// Estimators under one lock, in the order in which a message reaches them.
#[derive(Clone, Debug)]
pub(super) struct Island {
    /// The first of them, which gives the island its name.
    pub(super) first: EstimatorId,
    pub(super) estimators: Vec<EstimatorId>,
}

/// The islands of a robot.
#[derive(Clone, Debug)]
pub(super) struct Islands {
    pub(super) all: Table<IslandId, Island>,
    /// The island of each estimator.
    pub(super) of: Table<EstimatorId, IslandId>,
}

/// The source of an input.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Feed {
    /// A sensor or a service, by its publisher.
    Outside(PublisherId),
    Island(IslandId),
}

impl Islands {
    pub(super) fn of(verified: &Verified<'_>) -> Self {
        let robot = verified.robot;
        let depths = order::depths(verified);
        let mut order: Vec<EstimatorId> = robot.estimators.ids().collect();
        order.sort_by_key(|id| (depths[*id], *id));
        // Each gets its own island before its consumers are examined.
        let of = robot.estimators.map(|_| IslandId::new(0));
        let mut islands = Self { all: Table::new(), of };
        let mut begun: HashMap<Feed, IslandId> = HashMap::new();
        for id in order {
            let mut feeds = sources(verified, id).map(|source| {
                let feed = islands.feed(robot, source);
                begun.get(&feed).map_or(feed, |island| Feed::Island(*island))
            });
            let first = feeds.next();
            let alone = first.filter(|first| feeds.all(|feed| feed == *first) && !is_worker(robot, id));
            drop(feeds);
            let island = match alone {
                Some(Feed::Island(island)) => island,
                Some(feed) => *begun.entry(feed).or_insert_with(|| islands.begin(id)),
                None => islands.begin(id),
            };
            islands.of[id] = island;
            islands.all[island].estimators.push(id);
        }
        islands
    }

    fn begin(&mut self, first: EstimatorId) -> IslandId {
        self.all.push(Island { first, estimators: Vec::new() })
    }

    fn feed(&self, robot: &Robot, publisher: PublisherId) -> Feed {
        match robot.publishers[publisher].from {
            From::Estimator(id, _) => Feed::Island(self.of[id]),
            From::Sensor(_) | From::Service(_) => Feed::Outside(publisher),
        }
    }
}

/// The publishers of all inputs of an estimator; for a nested one, its sensor's.
pub(super) fn sources<'a>(
    verified: &'a Verified<'_>,
    id: EstimatorId,
) -> impl Iterator<Item = PublisherId> + use<'a> {
    let robot = verified.robot;
    let nested = match robot.estimators[id].home {
        Home::Sensor(sensor) => Some(robot.sensors[sensor].publisher),
        Home::Link(_) => None,
    };
    nested.into_iter().chain(verified.sources[id].iter().copied())
}

fn is_worker(robot: &Robot, id: EstimatorId) -> bool {
    robot.estimators[id].worker.is_some()
}
