//! A robot's description, from its declaration and its state.

use super::Robot;
use crate::component::{
    CommandInfo, ComponentDescription, ComponentKind, Description, InputDescription, JointDescription,
    LinkDescription, ParameterDescription, TopicDescription,
};
use crate::declaration::schema::parameter_schema;
use crate::declaration::{Graphed, SensorDeclaration};
use crate::event::ParameterValue;
use crate::pubsub::AnyTopic;
use std::time::Duration;

/// What a graph of the robot shows.
pub(super) fn graphed<R: Robot>() -> Graphed {
    Graphed {
        topology: R::TOPOLOGY,
        sensors: R::SENSORS,
        estimators: R::ESTIMATORS,
        actuators: R::ACTUATORS,
        services: R::SERVICES,
        commands: R::COMMANDS,
    }
}

/// The description of a robot with these topics, values of its parameters and commands.
pub(super) fn discover<R: Robot>(
    topics: &[&dyn AnyTopic],
    values: &[ParameterValue],
    commands: Vec<CommandInfo>,
    is_replaced: &dyn Fn(&str) -> bool,
) -> Description {
    let paths: Vec<_> = topics.iter().map(|topic| topic.path()).collect();
    let sources = R::SENSORS.iter().chain(R::SERVICES);
    let sources = sources.map(|declared| ComponentDescription {
        path: declared.path,
        kind: kind(declared.path),
        frame: declared.frame.name(),
        period: period(declared),
        inputs: Vec::new(),
        topics: published(&paths, declared.path, &[]),
        is_replaced: is_replaced(declared.path),
    });
    let estimators = R::ESTIMATORS.iter().map(|declared| ComponentDescription {
        path: declared.path,
        kind: ComponentKind::Estimator,
        frame: declared.frame.name(),
        period: None,
        inputs: declared
            .inputs
            .iter()
            .map(|input| InputDescription {
                name: input.name,
                source: input.source,
                is_driver: input.driver,
                is_optional: input.optional,
            })
            .collect(),
        topics: published(&paths, declared.path, declared.outputs),
        is_replaced: is_replaced(declared.path),
    });
    let actuators = R::ACTUATORS.iter().map(|declared| ComponentDescription {
        path: declared.path,
        kind: ComponentKind::Actuator,
        frame: declared.joint,
        period: None,
        inputs: Vec::new(),
        topics: published(&paths, declared.path, &[]),
        is_replaced: is_replaced(declared.path),
    });
    let components: Vec<_> = sources.chain(estimators).chain(actuators).collect();
    let topics = topics.iter().map(|topic| TopicDescription {
        path: topic.path(),
        payload: topic.payload_name(),
        period: components.iter().find(|component| component.path == topic.path()).and_then(|found| found.period),
    });
    Description {
        robot: R::NAME,
        links: links::<R>(),
        joints: joints::<R>(),
        topics: topics.collect(),
        components,
        parameters: parameters::<R>(values),
        commands,
        states: ["disarmed", "idle", "executing"].into_iter().chain(R::STATES.iter().copied()).collect(),
    }
}

fn kind(path: &str) -> ComponentKind {
    match path.split('/').next() {
        Some("controller") => ComponentKind::Controller,
        Some("bridge") => ComponentKind::Bridge,
        _ => ComponentKind::Sensor,
    }
}

fn period(declared: &SensorDeclaration) -> Option<Duration> {
    declared.period_nanos.and_then(|nanos| u64::try_from(nanos).ok()).map(Duration::from_nanos)
}

/// The topics at these paths, at the path of the component itself, and those of its motions.
fn published(paths: &[&'static str], own: &'static str, outputs: &[&'static str]) -> Vec<&'static str> {
    let is_motion =
        |path: &str| path.strip_prefix(own).is_some_and(|rest| matches!(rest, "/begin_motion" | "/end_motion"));
    paths.iter().copied().filter(|path| *path == own || outputs.contains(path) || is_motion(path)).collect()
}

fn links<R: Robot>() -> Vec<LinkDescription> {
    let describe = |link: &'static crate::topology::Link| LinkDescription {
        path: R::TOPOLOGY.link_path(link),
        name: link.name,
        parent_joint: link.parent_joint.and_then(|joint| R::TOPOLOGY.joints.get(joint)).map(|joint| joint.name),
        mass: link.inertial.map(|inertial| inertial.mass),
    };
    R::TOPOLOGY.links.iter().map(describe).collect()
}

fn joints<R: Robot>() -> Vec<JointDescription> {
    let link = |number: usize| R::TOPOLOGY.links.get(number).map_or("", |link| link.name);
    let describe = |joint: &'static crate::topology::Joint| JointDescription {
        path: R::TOPOLOGY.joint_path(joint),
        name: joint.name,
        kind: joint.kind,
        parent: link(joint.parent),
        child: link(joint.child),
        limit: joint.limit,
        mimics: joint.mimic.and_then(|mimic| R::TOPOLOGY.joints.get(mimic.joint)).map(|joint| joint.name),
        actuators: R::ACTUATORS
            .iter()
            .filter(|actuator| actuator.joint == joint.name)
            .map(|actuator| actuator.path)
            .collect(),
    };
    R::TOPOLOGY.joints.iter().map(describe).collect()
}

fn parameters<R: Robot>(values: &[ParameterValue]) -> Vec<ParameterDescription> {
    let describe = |(number, declared): (usize, &'static crate::declaration::ParameterDeclaration)| {
        let default = ParameterValue::from(declared.default);
        ParameterDescription {
            path: declared.path,
            doc: declared.doc,
            value: values.get(number).cloned().unwrap_or_else(|| default.clone()),
            default,
            unit: declared.unit,
            schema: parameter_schema(declared),
        }
    };
    R::PARAMETERS.iter().enumerate().map(describe).collect()
}
