//! A shape as text for other programs: `ros2msg`, the message definitions of ROS 2.

use super::definitions::{Count, Definition, Element, definitions};
use super::type_description::type_name;
use super::{Shape, StructShape};
use std::fmt::Write;

/// The information a program needs to read the bytes of a type it does not know.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Schema {
    /// The type's full name: `sensor_msgs/msg/Imu`.
    pub name: String,
    /// The definition, and those of all types it refers to.
    pub text: String,
}

impl Schema {
    /// The format of [`text`](Self::text), as named by MCAP.
    pub const ENCODING: &'static str = "ros2msg";
    /// The encoding of messages, as named by MCAP.
    pub const MESSAGE_ENCODING: &'static str = "cdr";

    /// Creates the schema of the type `name` with the given shape.
    pub fn new(name: &str, shape: Shape) -> Self {
        let definitions = definitions(name, shape);
        let mut text = String::new();
        for (index, definition) in definitions.iter().enumerate() {
            if index > 0 {
                line(&mut text, &format!("{}\nMSG: {}", "=".repeat(80), definition.name));
            }
            body(definition, &mut text);
        }
        Self { name: definitions.first().map_or(String::new(), |main| type_name(&main.name)), text }
    }

    /// Schema of a struct, under its own name.
    pub(super) fn of(shape: &'static StructShape) -> Self {
        Self::new(shape.name, Shape::Struct(shape))
    }
}

fn body(definition: &Definition, text: &mut String) {
    for (name, number) in &definition.constants {
        line(text, &format!("uint32 {name}={number}"));
    }
    for field in &definition.fields {
        let element = match &field.element {
            Element::Primitive(primitive) => primitive.name,
            Element::Message(name) => name,
        };
        let count = match field.count {
            Count::One => String::new(),
            Count::Exactly(length) => format!("[{length}]"),
            Count::AtMostOne => "[<=1]".to_owned(),
            Count::Any => "[]".to_owned(),
        };
        line(text, &format!("{element}{count} {}", field.name));
    }
}

fn line(text: &mut String, line: &str) {
    // Writing to a string cannot fail.
    let _ = writeln!(text, "{line}");
}
