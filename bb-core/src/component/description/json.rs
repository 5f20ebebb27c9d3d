//! A description as JSON. Quantities are in SI, and what is unknown or infinite is `null`; schemas are objects.

use super::{
    ComponentDescription, Description, InputDescription, JointDescription, LinkDescription, ParameterDescription,
    TopicDescription,
};
use crate::component::CommandInfo;
use crate::event::ParameterValue;
use crate::message::codec::compose::{array, null, number, object, optional, text};
use crate::message::codec::{Layouts, Schema, json_schema};
use crate::topology::{Geometry, Origin, Visual};
use std::time::Duration;

impl Description {
    /// One JSON object with the lists `links`, `joints`, `components`, `topics`, `parameters`, `commands` and `states`, whose
    /// elements have a `path`. The `layout` of a topic is an index of the list `layouts`.
    pub fn to_json(&self) -> String {
        let mut layouts: Vec<Layouts> = Vec::new();
        let topics: Vec<String> = self.topics.iter().map(|of| topic(of, &mut layouts)).collect();
        object(&[
            ("robot", text(self.robot)),
            ("run", text(self.run.name())),
            ("states", array(&mut self.states.iter().map(|state| text(state)))),
            ("links", array(&mut self.links.iter().map(link))),
            ("joints", array(&mut self.joints.iter().map(joint))),
            ("components", array(&mut self.components.iter().map(component))),
            ("topics", array(&mut topics.into_iter())),
            ("layouts", array(&mut layouts.iter().map(layout))),
            ("parameters", array(&mut self.parameters.iter().map(parameter))),
            ("commands", array(&mut self.commands.iter().map(command))),
        ])
    }
}

fn link(link: &LinkDescription) -> String {
    object(&[
        ("path", text(&link.path)),
        ("name", text(link.name)),
        ("parent_joint", optional(link.parent_joint, text)),
        ("mass", optional(link.mass, number)),
        ("visuals", array(&mut link.visuals.iter().map(visual))),
    ])
}

fn visual(visual: &Visual) -> String {
    let geometry = match visual.geometry {
        Geometry::Box(sides) => ("box", numbers(&sides)),
        Geometry::Cylinder { radius, length } => {
            ("cylinder", object(&[("radius", number(radius)), ("length", number(length))]))
        }
        Geometry::Sphere { radius } => ("sphere", object(&[("radius", number(radius))])),
        Geometry::Mesh { file, scale } => ("mesh", object(&[("file", text(file)), ("scale", numbers(&scale))])),
    };
    let color = visual.material.and_then(|material| material.color);
    object(&[
        ("geometry", object(&[geometry])),
        ("origin", origin(&visual.link_from_shape)),
        ("color", optional(color, |color| numbers(&color))),
    ])
}

/// Translation, and rotation as x, y, z, w.
fn origin(origin: &Origin) -> String {
    let rotation = origin.isometry().rotation;
    object(&[("xyz", numbers(&origin.xyz)), ("quaternion", numbers(rotation.coords.as_slice()))])
}

fn numbers(numbers: &[f64]) -> String {
    array(&mut numbers.iter().map(|one| number(*one)))
}

fn joint(joint: &JointDescription) -> String {
    let limit = joint.limit.map(|limit| {
        object(&[
            ("lower", optional(limit.lower, number)),
            ("upper", optional(limit.upper, number)),
            ("velocity", optional(limit.velocity, number)),
            ("effort", optional(limit.effort, number)),
        ])
    });
    object(&[
        ("path", text(&joint.path)),
        ("name", text(joint.name)),
        ("kind", text(joint.kind.name())),
        ("parent", text(joint.parent)),
        ("child", text(joint.child)),
        ("origin", origin(&joint.parent_from_joint)),
        ("limit", limit.unwrap_or_else(null)),
        ("mimics", optional(joint.mimics, text)),
        ("actuators", array(&mut joint.actuators.iter().map(|path| text(path)))),
    ])
}

fn component(component: &ComponentDescription) -> String {
    object(&[
        ("path", text(component.path)),
        ("kind", text(component.kind.name())),
        ("frame", text(component.frame)),
        ("rate_hz", rate(component.period)),
        ("inputs", array(&mut component.inputs.iter().map(input))),
        ("topics", array(&mut component.topics.iter().map(|path| text(path)))),
        ("command", optional(component.command, json_schema)),
        ("replaced", component.is_replaced.to_string()),
    ])
}

fn input(input: &InputDescription) -> String {
    object(&[
        ("name", text(input.name)),
        ("source", text(input.source)),
        ("driver", input.is_driver.to_string()),
        ("optional", input.is_optional.to_string()),
    ])
}

fn topic(topic: &TopicDescription, layouts: &mut Vec<Layouts>) -> String {
    let known = layouts.iter().position(|layouts| *layouts == topic.layouts);
    let layout = known.unwrap_or_else(|| {
        layouts.push(topic.layouts);
        layouts.len() - 1
    });
    object(&[
        ("path", text(topic.path)),
        ("payload", text(topic.payload)),
        ("rate_hz", rate(topic.period)),
        ("external", topic.is_external.to_string()),
        ("layout", layout.to_string()),
    ])
}

fn layout(layouts: &Layouts) -> String {
    let definition = |schema: &Schema| [("name", text(&schema.name)), ("definition", text(&schema.text))];
    let ros = layouts.ros_schema().map(|schema| {
        let [name, definition] = definition(&schema);
        object(&[name, ("hash", optional(layouts.ros_type_hash(), |hash| text(&hash))), definition])
    });
    let companion = layouts.ros_companion().map(|(topic, schema)| {
        let [name, definition] = definition(&schema);
        object(&[("topic", text(topic)), name, definition])
    });
    object(&[
        ("schema", layouts.json_schema()),
        ("exact", object(&definition(&layouts.schema()))),
        ("ros", ros.unwrap_or_else(null)),
        ("companion", companion.unwrap_or_else(null)),
    ])
}

fn parameter(parameter: &ParameterDescription) -> String {
    object(&[
        ("path", text(parameter.path)),
        ("doc", text(parameter.doc.trim())),
        ("type", text(parameter.default.type_name())),
        ("value", value(&parameter.value)),
        ("default", value(&parameter.default)),
        ("unit", text(parameter.unit)),
        ("minimum", optional(parameter.range.as_ref().map(|range| *range.start()), number)),
        ("maximum", optional(parameter.range.as_ref().map(|range| *range.end()), number)),
        ("schema", parameter.schema.clone()),
    ])
}

fn command(command: &CommandInfo) -> String {
    let states = command.allowed_states.map(|states| array(&mut states.iter().map(|state| text(state))));
    object(&[
        ("path", text(command.path)),
        ("role", text(command.role.name())),
        ("category", text(command.category)),
        ("allowed_states", states.unwrap_or_else(null)),
        ("timeout_s", optional(command.timeout.map(|timeout| timeout.as_secs_f64()), number)),
        ("arguments", command.argument_schema()),
        ("definition", optional(command.argument_definition().as_deref(), text)),
        ("defaults", if command.default_arguments.is_empty() { null() } else { command.default_arguments.clone() }),
        ("result", json_schema(command.output)),
    ])
}

fn rate(period: Option<Duration>) -> String {
    optional(period.map(|period| 1.0 / period.as_secs_f64()), number)
}

fn value(value: &ParameterValue) -> String {
    match value {
        ParameterValue::Bool(value) => value.to_string(),
        ParameterValue::Integer(value) => value.to_string(),
        ParameterValue::Float(value) => number(*value),
        ParameterValue::Text(value) => text(value),
    }
}
