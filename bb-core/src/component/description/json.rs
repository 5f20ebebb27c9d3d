//! A description as JSON. Quantities are in SI, and what is unknown or infinite is `null`; schemas are objects.

use super::{
    ComponentDescription, Description, InputDescription, JointDescription, LinkDescription, ParameterDescription,
    TopicDescription,
};
use crate::component::CommandInfo;
use crate::event::ParameterValue;
use crate::message::codec::{Layouts, json_schema};
use crate::topology::{Geometry, Origin, Visual};
use bb_message::__private::compose::{Object, object};
use std::time::Duration;

impl Description {
    /// One JSON object with the lists `links`, `joints`, `components`, `topics`, `parameters`, `commands` and `states`, whose
    /// elements have a `path`. The `layout` of a topic is an index of the list `layouts`.
    pub fn to_json(&self) -> String {
        let mut layouts: Vec<Layouts> = Vec::new();
        for topic in &self.topics {
            if !layouts.contains(&topic.layouts) {
                layouts.push(topic.layouts);
            }
        }
        let topics: Vec<_> = self.topics.iter().map(|topic| (topic, layouts.as_slice())).collect();
        object(|json| {
            json.text("robot", self.robot);
            json.text("run", self.run.name());
            json.texts("states", &self.states);
            json.objects("links", &self.links, link);
            json.objects("joints", &self.joints, joint);
            json.objects("components", &self.components, component);
            json.objects("topics", &topics, topic);
            json.objects("layouts", &layouts, layout);
            json.objects("parameters", &self.parameters, parameter);
            json.objects("commands", &self.commands, command);
        })
    }
}

fn link(link: &LinkDescription, json: &mut Object<'_>) {
    json.text("path", &link.path);
    json.text("name", link.name);
    json.optional_text("parent_joint", link.parent_joint);
    json.optional_number("mass", link.mass);
    json.objects("visuals", link.visuals, visual);
}

fn visual(visual: &Visual, json: &mut Object<'_>) {
    json.object("geometry", |json| match visual.geometry {
        Geometry::Box(sides) => json.numbers("box", &sides),
        Geometry::Cylinder { radius, length } => json.object("cylinder", |json| {
            json.number("radius", radius);
            json.number("length", length);
        }),
        Geometry::Sphere { radius } => json.object("sphere", |json| json.number("radius", radius)),
        Geometry::Mesh { file, scale } => json.object("mesh", |json| {
            json.text("file", file);
            json.numbers("scale", &scale);
        }),
    });
    origin(&visual.link_from_shape, json);
    match visual.material.and_then(|material| material.color) {
        Some(color) => json.numbers("color", &color),
        None => json.null("color"),
    }
}

/// Translation, and rotation as x, y, z, w.
fn origin(origin: &Origin, json: &mut Object<'_>) {
    json.object("origin", |json| {
        json.numbers("xyz", &origin.xyz);
        json.numbers("quaternion", origin.isometry().rotation.coords.as_slice());
    });
}

fn joint(joint: &JointDescription, json: &mut Object<'_>) {
    json.text("path", &joint.path);
    json.text("name", joint.name);
    json.text("kind", joint.kind.name());
    json.text("parent", joint.parent);
    json.text("child", joint.child);
    origin(&joint.parent_from_joint, json);
    match joint.limit {
        Some(limit) => json.object("limit", |json| {
            json.optional_number("lower", limit.lower);
            json.optional_number("upper", limit.upper);
            json.optional_number("velocity", limit.velocity);
            json.optional_number("effort", limit.effort);
        }),
        None => json.null("limit"),
    }
    json.optional_text("mimics", joint.mimics);
    json.texts("actuators", &joint.actuators);
}

fn component(component: &ComponentDescription, json: &mut Object<'_>) {
    json.text("path", component.path);
    json.text("kind", component.kind.name());
    json.text("frame", component.frame);
    json.optional_number("rate_hz", component.period.map(rate));
    json.objects("inputs", &component.inputs, input);
    json.texts("topics", &component.topics);
    json.json("command", component.command.map(json_schema).as_deref().unwrap_or("null"));
    json.flag("replaced", component.is_replaced);
}

fn input(input: &InputDescription, json: &mut Object<'_>) {
    json.text("name", input.name);
    json.text("source", input.source);
    json.flag("driver", input.is_driver);
    json.flag("optional", input.is_optional);
}

/// A topic, with its place in the list of layouts.
fn topic((topic, layouts): &(&TopicDescription, &[Layouts]), json: &mut Object<'_>) {
    let layout = layouts.iter().position(|layouts| *layouts == topic.layouts).unwrap_or(0);
    json.text("path", topic.path);
    json.text("payload", topic.payload);
    json.optional_number("rate_hz", topic.period.map(rate));
    json.flag("external", topic.is_external);
    json.count("layout", layout as u64);
}

fn layout(layouts: &Layouts, json: &mut Object<'_>) {
    json.json("schema", &layouts.json_schema());
    json.object("exact", |json| {
        let schema = layouts.schema();
        json.text("name", &schema.name);
        json.text("definition", &schema.text);
    });
    match layouts.ros_schema() {
        Some(schema) => json.object("ros", |json| {
            json.text("name", &schema.name);
            json.optional_text("hash", layouts.ros_type_hash().as_deref());
            json.text("definition", &schema.text);
        }),
        None => json.null("ros"),
    }
    match layouts.ros_companion() {
        Some((topic, schema)) => json.object("companion", |json| {
            json.text("topic", topic);
            json.text("name", &schema.name);
            json.text("definition", &schema.text);
        }),
        None => json.null("companion"),
    }
}

fn parameter(parameter: &ParameterDescription, json: &mut Object<'_>) {
    json.text("path", parameter.path);
    json.text("doc", parameter.doc.trim());
    json.text("type", parameter.default.type_name());
    value("value", &parameter.value, json);
    value("default", &parameter.default, json);
    json.text("unit", parameter.unit);
    json.optional_number("minimum", parameter.range.as_ref().map(|range| *range.start()));
    json.optional_number("maximum", parameter.range.as_ref().map(|range| *range.end()));
    json.json("schema", &parameter.schema);
}

fn command(command: &CommandInfo, json: &mut Object<'_>) {
    json.text("path", command.path);
    json.text("role", command.role.name());
    json.text("category", command.category);
    match command.allowed_states {
        Some(states) => json.texts("allowed_states", states),
        None => json.null("allowed_states"),
    }
    json.optional_number("timeout_s", command.timeout.map(|timeout| timeout.as_secs_f64()));
    json.json("arguments", &command.argument_schema());
    json.optional_text("definition", command.argument_definition().as_deref());
    json.json("defaults", if command.default_arguments.is_empty() { "null" } else { &command.default_arguments });
    json.json("result", &json_schema(command.output));
}

fn rate(period: Duration) -> f64 {
    1.0 / period.as_secs_f64()
}

fn value(name: &str, value: &ParameterValue, json: &mut Object<'_>) {
    match value {
        ParameterValue::Bool(value) => json.flag(name, *value),
        ParameterValue::Integer(value) => json.json(name, &value.to_string()),
        ParameterValue::Float(value) => json.number(name, *value),
        ParameterValue::Text(value) => json.text(name, value),
    }
}
