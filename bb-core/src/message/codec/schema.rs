//! A shape as text for other programs: `ros2msg`, the message definitions of ROS 2.
//!
//! What ROS 2 does not have is written as what has the same bytes: an optional value as a list of at most one, a list of
//! lists through a message with one field `data`, an enum as the number of its variant, whose names stand as constants
//! above it, and a list of at most one for the fields of each variant that has some.

use super::shape::{EnumShape, FieldShape, Shape, StructShape};
use std::fmt::Write;

/// What a program that does not know a type needs to read its bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Schema {
    /// The type's full name: `sensor_msgs/msg/Imu`.
    pub name: String,
    /// The definition, and those of all types it names.
    pub text: String,
}

/// The package of types that are not of ROS.
const PACKAGE: &str = "bb_msgs";

impl Schema {
    /// How [`text`](Self::text) is written, as MCAP names it.
    pub const ENCODING: &'static str = "ros2msg";
    /// How messages are encoded, as MCAP names it.
    pub const MESSAGE_ENCODING: &'static str = "cdr";

    /// Of the type `name` with the given shape.
    pub fn new(name: &str, shape: Shape) -> Self {
        let name = full_name(name);
        let mut definitions =
            Definitions { known: vec![(name.clone(), Definition::Message(shape))], text: Vec::new() };
        let main = definitions.body(&name, Definition::Message(shape));
        let mut text = main;
        // A definition may name further ones.
        let mut next = 1;
        while let Some((name, definition)) = definitions.known.get(next).cloned() {
            let body = definitions.body(&name, definition);
            definitions.text.push(format!("{}\nMSG: {name}\n{body}", "=".repeat(80)));
            next += 1;
        }
        for definition in definitions.text {
            text.push_str(&definition);
        }
        let (package, kind) = name.split_once('/').unwrap_or((PACKAGE, &name));
        Self { name: format!("{package}/msg/{kind}"), text }
    }
}

/// What stands behind a name.
#[derive(Clone, Copy, PartialEq)]
enum Definition {
    /// A struct or an enum; anything else is one field `data`.
    Message(Shape),
    /// The fields of a variant.
    Variant(&'static StructShape),
}

struct Definitions {
    known: Vec<(String, Definition)>,
    text: Vec<String>,
}

impl Definitions {
    fn body(&mut self, name: &str, definition: Definition) -> String {
        let mut body = String::new();
        match definition {
            Definition::Message(Shape::Struct(shape)) | Definition::Variant(shape) => {
                self.fields(shape.name, shape.fields, &mut body);
            }
            Definition::Message(Shape::Enum(shape)) => self.variants(shape, &mut body),
            Definition::Message(shape) => self.fields(name, &[FieldShape { name: "data", shape }], &mut body),
        }
        body
    }

    fn fields(&mut self, owner: &str, fields: &[FieldShape], body: &mut String) {
        let mut names = Vec::new();
        for field in fields {
            let name = unique(field_name(field.name), &mut names);
            let kind = self.kind(field.shape, &format!("{}{}", type_name(owner), type_name(field.name)));
            line(body, &format!("{kind} {name}"));
        }
    }

    fn variants(&mut self, shape: &EnumShape, body: &mut String) {
        let mut names = vec!["KIND".to_owned()];
        for (number, variant) in shape.variants.iter().enumerate() {
            let name = unique(snake(variant.name).to_uppercase(), &mut names);
            line(body, &format!("uint32 {name}={number}"));
        }
        line(body, "uint32 kind");
        let mut names = vec!["kind".to_owned()];
        for variant in shape.variants.iter().filter(|variant| !variant.fields.is_empty()) {
            let name = unique(field_name(&snake(variant.name)), &mut names);
            let kind = format!("{}{}", type_name(shape.name), type_name(variant.name));
            let kind = self.define(&kind, Definition::Variant(variant));
            line(body, &format!("{kind}[<=1] {name}"));
        }
    }

    /// The type of a field, as it stands before its name. `context` names what has to be named.
    fn kind(&mut self, shape: Shape, context: &str) -> String {
        let primitive = match shape {
            Shape::Bool => "bool",
            Shape::Char | Shape::U32 => "uint32",
            Shape::I8 => "int8",
            Shape::I16 => "int16",
            Shape::I32 => "int32",
            Shape::I64 => "int64",
            Shape::U8 => "uint8",
            Shape::U16 => "uint16",
            Shape::U64 => "uint64",
            Shape::F32 => "float32",
            Shape::F64 => "float64",
            Shape::Text => "string",
            Shape::Option(of) => return format!("{}[<=1]", self.element(*of, context)),
            Shape::List(of) => return format!("{}[]", self.element(*of, context)),
            Shape::Array(mut of, mut length) => {
                // Arrays of arrays have the bytes of a flat one.
                while let Shape::Array(inner, count) = of {
                    (of, length) = (inner, length * count);
                }
                return format!("{}[{length}]", self.element(*of, context));
            }
            Shape::Struct(of) => return self.define(of.name, Definition::Message(shape)),
            Shape::Enum(of) => return self.define(of.name, Definition::Message(shape)),
        };
        primitive.to_owned()
    }

    /// The same where no list may stand.
    fn element(&mut self, shape: Shape, context: &str) -> String {
        match shape {
            Shape::Option(_) | Shape::List(_) | Shape::Array(..) => {
                self.define(context, Definition::Message(shape))
            }
            _ => self.kind(shape, context),
        }
    }

    /// The name of a definition, which is made if there is none yet. Different ones of one name get numbers.
    fn define(&mut self, name: &str, definition: Definition) -> String {
        let name = full_name(name);
        for number in 1.. {
            let name = if number == 1 { name.clone() } else { format!("{name}{number}") };
            match self.known.iter().find(|(known, _)| *known == name) {
                Some((_, known)) if *known == definition => return name,
                Some(_) => {}
                None => {
                    self.known.push((name.clone(), definition));
                    return name;
                }
            }
        }
        name
    }
}

fn line(text: &mut String, line: &str) {
    // Writing to a string cannot fail.
    let _ = writeln!(text, "{line}");
}

/// With a package.
fn full_name(name: &str) -> String {
    match name.split_once('/') {
        Some(_) => name.to_owned(),
        None => format!("{PACKAGE}/{}", type_name(name)),
    }
}

/// What ROS takes as the name of a type: letters and digits, a capital first.
fn type_name(name: &str) -> String {
    let name = name.rsplit('/').next().unwrap_or(name);
    let mut result = String::new();
    let mut is_start = true;
    for letter in name.chars() {
        if letter.is_ascii_alphanumeric() {
            result.push(if is_start { letter.to_ascii_uppercase() } else { letter });
            is_start = false;
        } else {
            is_start = true;
        }
    }
    if !result.starts_with(|first: char| first.is_ascii_alphabetic()) {
        result.insert_str(0, "Item");
    }
    result
}

/// `fooBar` and `FooBar` to `foo_bar`.
fn snake(name: &str) -> String {
    let mut result = String::new();
    let mut was_small = false;
    for letter in name.chars() {
        if letter.is_uppercase() && was_small {
            result.push('_');
        }
        was_small = !letter.is_uppercase() && letter != '_';
        result.extend(letter.to_lowercase());
    }
    field_name(&result)
}

/// What ROS takes as the name of a field: small letters, digits and single underscores, a letter first, none last.
fn field_name(name: &str) -> String {
    let mut result = String::new();
    for letter in name.chars().flat_map(char::to_lowercase) {
        let letter = if letter.is_ascii_alphanumeric() { letter } else { '_' };
        if letter != '_' || !(result.is_empty() || result.ends_with('_')) {
            result.push(letter);
        }
    }
    let result = result.trim_end_matches('_');
    match result.starts_with(|first: char| first.is_ascii_alphabetic()) {
        true => result.to_owned(),
        false => format!("field_{result}").trim_end_matches('_').to_owned(),
    }
}

fn unique(name: String, names: &mut Vec<String>) -> String {
    let mut result = name.clone();
    let mut number = 2;
    while names.contains(&result) {
        result = format!("{name}_{number}");
        number += 1;
    }
    names.push(result.clone());
    result
}
