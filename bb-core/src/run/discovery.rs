//! A robot's description, from its declaration and its state.

use crate::component::{
    CommandInfo, ComponentDescription, ComponentKind, Description, InputDescription, JointDescription,
    LinkDescription, ParameterDescription, RunKind, TopicDescription,
};
use crate::declaration::schema::parameter_schema;
use crate::declaration::{RobotDeclaration, SensorDeclaration};
use crate::event::ParameterValue;
use crate::pubsub::AnyTopic;
use std::time::Duration;

/// The description of a robot with these topics, values of its parameters and commands.
pub(super) fn discover(
    robot: &RobotDeclaration,
    run: RunKind,
    topics: &[&dyn AnyTopic],
    values: &[ParameterValue],
    commands: Vec<CommandInfo>,
    is_replaced: &dyn Fn(&str) -> bool,
    is_external: &dyn Fn(&str) -> bool,
) -> Description {
    let paths: Vec<_> = topics.iter().map(|topic| topic.path()).collect();
    let sources = robot.sensors.iter().chain(robot.services);
    let sources = sources.map(|declared| ComponentDescription {
        path: declared.path,
        kind: kind(declared.path),
        frame: declared.frame.name(),
        period: period(declared),
        inputs: Vec::new(),
        topics: published(&paths, declared.path, &[]),
        command: None,
        is_replaced: is_replaced(declared.path),
    });
    let estimators = robot.estimators.iter().map(|declared| ComponentDescription {
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
        command: None,
        is_replaced: is_replaced(declared.path),
    });
    let actuators = robot.actuators.iter().map(|declared| ComponentDescription {
        path: declared.path,
        kind: ComponentKind::Actuator,
        frame: declared.joint,
        period: None,
        inputs: Vec::new(),
        topics: published(&paths, declared.path, &[]),
        command: None,
        is_replaced: is_replaced(declared.path),
    });
    let components: Vec<_> = sources.chain(estimators).chain(actuators).collect();
    let topics = topics.iter().map(|topic| TopicDescription {
        path: topic.path(),
        payload: topic.payload_name(),
        layouts: topic.layouts(),
        is_external: is_external(topic.path()),
        period: components.iter().find(|component| component.path == topic.path()).and_then(|found| found.period),
    });
    Description {
        robot: robot.name,
        run,
        links: links(robot),
        joints: joints(robot),
        topics: topics.collect(),
        components,
        parameters: parameters(robot, values),
        commands,
        states: ["disarmed", "idle", "executing"].into_iter().chain(robot.states.iter().copied()).collect(),
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

fn links(robot: &RobotDeclaration) -> Vec<LinkDescription> {
    let describe = |link: &'static crate::topology::Link| LinkDescription {
        path: robot.topology.link_path(link),
        name: link.name,
        parent_joint: link.parent_joint.and_then(|joint| robot.topology.joints.get(joint)).map(|joint| joint.name),
        mass: link.inertial.map(|inertial| inertial.mass),
        visuals: link.visuals,
    };
    robot.topology.links.iter().map(describe).collect()
}

fn joints(robot: &RobotDeclaration) -> Vec<JointDescription> {
    let link = |number: usize| robot.topology.links.get(number).map_or("", |link| link.name);
    let describe = |joint: &'static crate::topology::Joint| JointDescription {
        path: robot.topology.joint_path(joint),
        name: joint.name,
        kind: joint.kind,
        parent: link(joint.parent),
        child: link(joint.child),
        parent_from_joint: joint.parent_from_joint,
        limit: joint.limit,
        mimics: joint.mimic.and_then(|mimic| robot.topology.joints.get(mimic.joint)).map(|joint| joint.name),
        actuators: robot
            .actuators
            .iter()
            .filter(|actuator| actuator.joint == joint.name)
            .map(|actuator| actuator.path)
            .collect(),
    };
    robot.topology.joints.iter().map(describe).collect()
}

fn parameters(robot: &RobotDeclaration, values: &[ParameterValue]) -> Vec<ParameterDescription> {
    let describe = |(number, declared): (usize, &'static crate::declaration::ParameterDeclaration)| {
        let default = ParameterValue::from(declared.default);
        ParameterDescription {
            path: declared.path,
            doc: declared.doc,
            value: values.get(number).cloned().unwrap_or_else(|| default.clone()),
            default,
            unit: declared.unit,
            range: declared.range.map(|range| range.start..=range.end),
            schema: parameter_schema(declared),
        }
    };
    robot.parameters.iter().enumerate().map(describe).collect()
}
