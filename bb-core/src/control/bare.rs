//! A control state without a robot around it, for tests.

use super::{Control, Parts, SystemTopics};
use crate::declaration::{EstimatorDeclaration, ParameterValues, RobotDeclaration};
use crate::lifecycle::Supervision;
use crate::message::Origin;
use crate::node::{Mode, SharedNode};
use crate::time::{Clock, MonotonicTime};
use crate::topology::Topology;
use std::sync::Arc;

static NOTHING: Topology = Topology { links: &[], joints: &[] };

/// Creates a control state with these estimators, whose nodes are `nodes`, and nothing else.
pub(super) fn control(
    mode: Mode,
    estimators: &'static [EstimatorDeclaration],
    nodes: impl IntoIterator<Item = SharedNode>,
) -> Control {
    let declared: &'static RobotDeclaration = Box::leak(Box::new(RobotDeclaration {
        name: "robot",
        topology: &NOTHING,
        sensors: &[],
        estimators,
        actuators: &[],
        services: &[],
        states: &[],
        categories: &[],
        commands: &[],
        parameters: &[],
        bound_options: &[],
    }));
    Control::new(Parts {
        declared,
        mode,
        topics: Arc::new(SystemTopics::new(declared)),
        clock: Clock::virtual_at(MonotonicTime::ZERO),
        origin: Origin::default(),
        commands: Vec::new(),
        parameters: ParameterValues::new(vec![]),
        supervision: Supervision::default(),
        nodes: nodes.into_iter().collect(),
        journal: None,
        telemetry: None,
    })
}
