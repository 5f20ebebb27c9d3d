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
    let describe = |path: &'static str, kind, frame, outputs: &[&'static str]| ComponentDescription {
        path,
        kind,
        frame,
        period: None,
        inputs: Vec::new(),
        topics: published(topics, path, outputs),
        command: None,
        is_replaced: is_replaced(path),
    };
    let mut components = Vec::new();
    for declared in robot.sensors.iter().chain(robot.services) {
        let component = describe(declared.path, kind(declared.path), declared.frame.name(), &[]);
        components.push(ComponentDescription { period: period(declared), ..component });
    }
    for declared in robot.estimators {
        let mut component =
            describe(declared.path, ComponentKind::Estimator, declared.frame.name(), declared.outputs);
        for input in declared.inputs {
            component.inputs.push(InputDescription {
                name: input.name,
                source: input.source,
                is_driver: input.driver,
                is_optional: input.optional,
            });
        }
        components.push(component);
    }
    for declared in robot.actuators {
        components.push(describe(declared.path, ComponentKind::Actuator, declared.joint, &[]));
    }
    let topics = topics.iter().map(|topic| TopicDescription {
        path: topic.path(),
        payload: topic.payload_name(),
        layouts: topic.layouts(),
        is_external: is_external(topic.path()),
        period: components.iter().find(|component| component.path == topic.path()).and_then(|found| found.period),
    });
    let mut states = vec!["disarmed", "idle", "executing"];
    states.extend(robot.states);
    Description {
        robot: robot.name,
        run,
        links: links(robot),
        joints: joints(robot),
        topics: topics.collect(),
        components,
        parameters: parameters(robot, values),
        commands,
        states,
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
fn published(topics: &[&dyn AnyTopic], own: &'static str, outputs: &[&'static str]) -> Vec<&'static str> {
    let mut paths = Vec::new();
    for path in topics.iter().map(|topic| topic.path()) {
        let is_own = matches!(path.strip_prefix(own), Some("" | "/begin_motion" | "/end_motion"));
        if is_own || outputs.contains(&path) {
            paths.push(path);
        }
    }
    paths
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
    let mut parameters = Vec::new();
    for (number, declared) in robot.parameters.iter().enumerate() {
        let default = ParameterValue::from(declared.default);
        parameters.push(ParameterDescription {
            path: declared.path,
            doc: declared.doc,
            value: values.get(number).unwrap_or(&default).clone(),
            default,
            unit: declared.unit,
            range: declared.range.map(|range| range.start..=range.end),
            schema: parameter_schema(declared),
        });
    }
    parameters
}
