//! The ROS message definitions for a shape.
//!
//! Types that ROS 2 does not have are replaced by types with the same bytes. An optional value becomes a list of at
//! most one. An inner list becomes a message with one field `data`. An enum becomes the number of its variant, with
//! constants for the names, and a list of at most one for the fields of each variant that has fields.

use super::shape::{EnumShape, FieldShape, Shape, StructShape};

/// The package of types that ROS does not have.
pub(super) const PACKAGE: &str = "bb_msgs";

/// A message.
#[derive(Debug)]
pub(super) struct Definition {
    /// `sensor_msgs/Imu`
    pub(super) name: String,
    /// The numbers of an enum's variants by name.
    pub(super) constants: Vec<(String, usize)>,
    pub(super) fields: Vec<MessageField>,
}

/// A field of a message.
#[derive(Debug)]
pub(super) struct MessageField {
    pub(super) name: String,
    pub(super) element: Element,
    pub(super) count: Count,
}

/// The type of a field, or of the elements of a list.
#[derive(Debug)]
pub(super) enum Element {
    Primitive(Primitive),
    /// `sensor_msgs/Imu`
    Message(String),
}

/// A built-in type of ROS's message definitions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Primitive {
    pub(super) name: &'static str,
    /// `FIELD_TYPE_…` of `type_description_interfaces/msg/FieldType`.
    pub(super) id: u32,
}

/// Number of elements of a field.
#[derive(Clone, Copy, Debug)]
pub(super) enum Count {
    One,
    Exactly(usize),
    AtMostOne,
    Any,
}

/// The type `name` with the given shape, then every message that it holds.
pub(super) fn definitions(name: &str, shape: Shape) -> Vec<Definition> {
    definitions_of(&[(name, shape)])
}

/// The types of these names with their shapes, then every message that they hold.
pub(super) fn definitions_of(types: &[(&str, Shape)]) -> Vec<Definition> {
    let sources = types.iter().map(|(name, shape)| (full_name(name), Source::Message(*shape)));
    let mut known = Known { sources: sources.collect() };
    let mut definitions = Vec::new();
    // A definition may refer to others.
    while let Some((name, source)) = known.sources.get(definitions.len()).cloned() {
        definitions.push(known.definition(name, source));
    }
    definitions
}

/// The source of a definition.
#[derive(Clone, Copy, PartialEq)]
enum Source {
    /// A struct or an enum; anything else is one field `data`.
    Message(Shape),
    /// The fields of a variant.
    Variant(&'static StructShape),
}

struct Known {
    sources: Vec<(String, Source)>,
}

impl Known {
    fn definition(&mut self, name: String, source: Source) -> Definition {
        let mut constants = Vec::new();
        let fields = match source {
            Source::Message(Shape::Struct(shape)) | Source::Variant(shape) => self.fields(shape.name, shape.fields),
            Source::Message(Shape::Enum(shape)) => self.variants(shape, &mut constants),
            Source::Message(shape) => self.fields(&name, &[FieldShape::new("data", shape)]),
        };
        Definition { name, constants, fields }
    }

    fn fields(&mut self, owner: &str, fields: &[FieldShape]) -> Vec<MessageField> {
        let mut names = Vec::new();
        let fields = fields.iter().map(|field| {
            let name = unique(field_name(field.name), &mut names);
            let (element, count) =
                self.kind(field.shape, &format!("{}{}", type_name(owner), type_name(field.name)));
            MessageField { name, element, count }
        });
        fields.collect()
    }

    fn variants(&mut self, shape: &EnumShape, constants: &mut Vec<(String, usize)>) -> Vec<MessageField> {
        let mut names = vec!["KIND".to_owned()];
        for (number, variant) in shape.variants.iter().enumerate() {
            constants.push((unique(snake(variant.name).to_uppercase(), &mut names), number));
        }
        let kind = Element::Primitive(Primitive::UINT32);
        let mut fields = vec![MessageField { name: "kind".to_owned(), element: kind, count: Count::One }];
        let mut names = vec!["kind".to_owned()];
        for variant in shape.variants.iter().filter(|variant| !variant.fields.is_empty()) {
            let name = unique(field_name(&snake(variant.name)), &mut names);
            let kind = format!("{}{}", type_name(shape.name), type_name(variant.name));
            let element = Element::Message(self.define(&kind, Source::Variant(variant)));
            fields.push(MessageField { name, element, count: Count::AtMostOne });
        }
        fields
    }

    /// The type of a field. `context` is the name for a definition that has none of its own.
    fn kind(&mut self, shape: Shape, context: &str) -> (Element, Count) {
        match shape {
            Shape::Option(of) => (self.element(*of, context), Count::AtMostOne),
            Shape::List(of) => (self.element(*of, context), Count::Any),
            Shape::Array(mut of, mut length) => {
                // Arrays of arrays have the bytes of a flat one.
                while let Shape::Array(inner, count) = of {
                    (of, length) = (inner, length * count);
                }
                (self.element(*of, context), Count::Exactly(length))
            }
            single => (self.element(single, context), Count::One),
        }
    }

    fn element(&mut self, shape: Shape, context: &str) -> Element {
        let name = match shape {
            Shape::Struct(of) => of.name,
            Shape::Enum(of) => of.name,
            // ROS has no lists of lists.
            Shape::Option(_) | Shape::List(_) | Shape::Array(..) => context,
            Shape::Bool => return Element::Primitive(Primitive { name: "bool", id: 15 }),
            Shape::I8 => return Element::Primitive(Primitive { name: "int8", id: 2 }),
            Shape::U8 => return Element::Primitive(Primitive { name: "uint8", id: 3 }),
            Shape::Byte => return Element::Primitive(Primitive { name: "byte", id: 16 }),
            Shape::I16 => return Element::Primitive(Primitive { name: "int16", id: 4 }),
            Shape::U16 => return Element::Primitive(Primitive { name: "uint16", id: 5 }),
            Shape::I32 => return Element::Primitive(Primitive { name: "int32", id: 6 }),
            Shape::Char | Shape::U32 => return Element::Primitive(Primitive::UINT32),
            Shape::I64 => return Element::Primitive(Primitive { name: "int64", id: 8 }),
            Shape::U64 => return Element::Primitive(Primitive { name: "uint64", id: 9 }),
            Shape::F32 => return Element::Primitive(Primitive { name: "float32", id: 10 }),
            Shape::F64 => return Element::Primitive(Primitive { name: "float64", id: 11 }),
            Shape::Text => return Element::Primitive(Primitive { name: "string", id: 17 }),
        };
        Element::Message(self.define(name, Source::Message(shape)))
    }

    /// Returns the name of a definition and adds it if it is new. Different definitions with the same name get numbers.
    fn define(&mut self, name: &str, source: Source) -> String {
        let name = full_name(name);
        for number in 1.. {
            let name = if number == 1 { name.clone() } else { format!("{name}{number}") };
            match self.sources.iter().find(|(known, _)| *known == name) {
                Some((_, known)) if *known == source => return name,
                Some(_) => {}
                None => {
                    self.sources.push((name.clone(), source));
                    return name;
                }
            }
        }
        name
    }
}

impl Primitive {
    const UINT32: Self = Self { name: "uint32", id: 7 };
}

/// Returns a type's name with its package.
fn full_name(name: &str) -> String {
    match name.split_once('/') {
        Some(_) => name.to_owned(),
        None => format!("{PACKAGE}/{}", type_name(name)),
    }
}

/// A valid ROS type name: letters and digits, a capital first.
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

/// A valid ROS field name: lower-case letters, digits and single underscores, a letter first, no underscore last.
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
