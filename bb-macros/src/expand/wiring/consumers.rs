//! Consumers of each publisher's messages, in the order in which they take them.

use crate::expand::islands::{IslandId, Islands};
use crate::expand::order;
use crate::model::{EstimatorId, Home, Id as _, PublisherId, Table};
use crate::verify::Verified;
use proc_macro2::{Ident, Span};

/// A declared input of an estimator, or the implicit one of a nested estimator.
pub(super) struct Consumer {
    pub(super) estimator: EstimatorId,
    pub(super) input: Option<usize>,
    /// `true` if a message makes the estimator run; otherwise it is kept until another one does.
    pub(super) runs: bool,
    /// Place at which rustc reports a payload mismatch: the path of the input, or the type of a nested estimator.
    pub(super) span: Span,
}

/// The consumers of each publisher, in the order in which they are called.
pub(super) fn consumers(verified: &Verified<'_>) -> Table<PublisherId, Vec<Consumer>> {
    let robot = verified.robot;
    let mut consumers: Table<PublisherId, Vec<Consumer>> = robot.publishers.map(|_| Vec::new());
    for (id, estimator) in robot.estimators.enumerate() {
        if let Home::Sensor(sensor) = estimator.home {
            let span = crate::diagnostics::Place::of(&estimator.component.kind).start;
            consumers[robot.sensors[sensor].publisher].push(Consumer {
                estimator: id,
                input: None,
                runs: true,
                span,
            });
        }
        for (number, (input, source)) in estimator.inputs.iter().zip(&verified.sources[id]).enumerate() {
            let span = input.path.0.last().map_or_else(Span::call_site, Ident::span);
            let runs = estimator.inputs.len() < 2 || input.driver.is_some();
            consumers[*source].push(Consumer { estimator: id, input: Some(number), runs, span });
        }
    }
    // Messages kept for later come first; then the estimators run. Those that take other estimators' outputs for the
    // same message come after them.
    let depths = order::depths(verified);
    for list in &mut consumers {
        list.sort_by_key(|consumer| (consumer.runs, depths[consumer.estimator], consumer.estimator));
    }
    consumers
}

/// The consumers of a publisher that belong to one island and are reached in one call: first those that keep the
/// message for later, then those that run.
pub(super) struct Visit<'a> {
    pub(super) island: IslandId,
    pub(super) runs: bool,
    pub(super) consumers: Vec<&'a Consumer>,
}

pub(super) fn visits<'a>(consumers: &'a [Consumer], islands: &Islands) -> Vec<Visit<'a>> {
    let mut visits: Vec<Visit<'_>> = Vec::new();
    for consumer in consumers {
        let island = islands.of[consumer.estimator];
        match visits.iter_mut().find(|visit| visit.island == island && visit.runs == consumer.runs) {
            Some(visit) => visit.consumers.push(consumer),
            None => visits.push(Visit { island, runs: consumer.runs, consumers: vec![consumer] }),
        }
    }
    visits
}

/// The journal's number for a publisher outside of an island.
pub(super) fn entry(publisher: PublisherId, runs: bool) -> usize {
    2 * publisher.number() + usize::from(runs)
}
