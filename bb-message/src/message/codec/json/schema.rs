//! A shape as JSON Schema: the JSON that [`from_json`](super::from_json) accepts.

use super::read::is_optional;
use super::write::text;
use super::{Form, INFINITY, NAN, NEGATIVE_INFINITY, range};
use crate::message::codec::{EnumShape, FieldRange, FieldShape, Shape, StructShape};

/// The JSON Schema (draft 2020-12) of a shape: for forms, and for programs that check what they send.
///
/// Nested structs and enums are defined once, under `$defs`. The schema accepts everything that
/// [`to_json`](super::to_json) writes. [`from_json`](super::from_json) also refuses repeated fields, numbers too large for
/// a float, and values that the type itself refuses.
///
/// ```
/// use bb_core::Field;
/// use bb_core::message::codec::json_schema;
/// use bb_core::prelude::*;
///
/// /// Arguments of a command.
/// #[derive(Clone, Debug, Payload)]
/// struct Beep {
///     /// How often.
///     times: u8,
/// }
///
/// assert_eq!(
///     json_schema(Beep::SHAPE),
///     r#"{"$schema":"https://json-schema.org/draft/2020-12/schema","title":"Beep","type":"object","#.to_owned()
///         + r#""properties":{"times":{"type":"integer","minimum":0,"maximum":255,"description":"How often."}},"#
///         + r#""required":["times"],"#
///         + r#""additionalProperties":false}"#
/// );
/// ```
pub fn json_schema(shape: Shape) -> String {
    let mut definitions = Definitions::default();
    let root = definitions.keywords(shape);
    document(&title(shape), &root, definitions)
}

/// A schema with these keywords, and the definitions it refers to.
pub fn document(title: &str, root: &str, mut definitions: Definitions) -> String {
    let mut json = r#"{"$schema":"https://json-schema.org/draft/2020-12/schema""#.to_owned();
    for keywords in [title, root] {
        if !keywords.is_empty() {
            json.push(',');
            json.push_str(keywords);
        }
    }
    // A definition may refer to others.
    let mut index = 0;
    while let Some((name, shape)) = definitions.known.get(index).cloned() {
        json.push_str(if index == 0 { r#","$defs":{"# } else { "," });
        text(&name, &mut json);
        json.push_str(":{");
        let title = self::title(shape);
        json.push_str(&title);
        json.push(',');
        json.push_str(&definitions.keywords(shape));
        json.push('}');
        index += 1;
    }
    json.push_str(if index == 0 { "}" } else { "}}" });
    json
}

fn title(shape: Shape) -> String {
    match shape {
        Shape::Struct(of) => member("title", of.name),
        Shape::Enum(of) => member("title", of.name),
        _ => String::new(),
    }
}

/// The structs and enums that a schema refers to.
#[derive(Debug, Default)]
pub struct Definitions {
    known: Vec<(String, Shape)>,
}

impl Definitions {
    /// The contents of a schema's braces.
    fn keywords(&mut self, shape: Shape) -> String {
        if let Some(range) = range(shape) {
            return format!(r#""type":"integer","minimum":{},"maximum":{}"#, range.start(), range.end());
        }
        match shape {
            Shape::Bool => member("type", "boolean"),
            Shape::Char => r#""type":"string","minLength":1,"maxLength":1"#.into(),
            Shape::Text => member("type", "string"),
            Shape::Option(of) => format!(r#""anyOf":[{},{{"type":"null"}}]"#, self.schema(*of)),
            Shape::List(of) => format!(r#""type":"array","items":{}"#, self.schema(*of)),
            Shape::Array(of, length) => {
                format!(r#""type":"array","items":{},"minItems":{length},"maxItems":{length}"#, self.schema(*of))
            }
            Shape::Struct(of) => match Form::of(of.fields) {
                Form::Transparent(shape) => self.keywords(shape),
                Form::Empty => r#""type":["object","null"],"additionalProperties":false"#.into(),
                Form::Object(fields) => self.object(fields),
            },
            Shape::Enum(of) => self.variants(of),
            // Integers are above.
            _ => {
                let special = array(&[NAN, INFINITY, NEGATIVE_INFINITY]);
                format!(r#""anyOf":[{{"type":"number"}},{{"enum":{special}}}]"#)
            }
        }
    }

    /// A schema in braces; a struct or an enum by reference.
    pub fn schema(&mut self, shape: Shape) -> String {
        let name = match shape {
            Shape::Struct(of) => match Form::of(of.fields) {
                Form::Transparent(shape) => return self.schema(shape),
                Form::Empty | Form::Object(_) => of.name,
            },
            Shape::Enum(of) => of.name,
            _ => return format!("{{{}}}", self.keywords(shape)),
        };
        format!("{{{}}}", member("$ref", &format!("#/$defs/{}", self.define(name, shape))))
    }

    /// Returns the name of a definition and adds it if it is new. Different definitions with the same name get numbers.
    fn define(&mut self, name: &str, shape: Shape) -> String {
        // The name becomes part of a JSON pointer in a URI, where a slash separates.
        let is_plain = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
        let name: String = name.chars().map(|letter| if is_plain(letter) { letter } else { '.' }).collect();
        let mut candidate = name.clone();
        let mut count = 1;
        loop {
            match self.known.iter().find(|(known, _)| *known == candidate) {
                Some((_, known)) if *known == shape => return candidate,
                Some(_) => {
                    count += 1;
                    candidate = format!("{name}.{count}");
                }
                None => {
                    self.known.push((candidate.clone(), shape));
                    return candidate;
                }
            }
        }
    }

    fn object(&mut self, fields: &[FieldShape]) -> String {
        let mut json = r#""type":"object","properties":{"#.to_owned();
        for (index, field) in fields.iter().enumerate() {
            if index > 0 {
                json.push(',');
            }
            text(field.name, &mut json);
            json.push(':');
            let schema = match field.range {
                Some(range) => ranged(field.shape, range),
                None => self.schema(field.shape),
            };
            json.push_str(&annotated(schema, field));
        }
        let is_required = |field: &&FieldShape| !is_optional(field.shape);
        let required: Vec<_> = fields.iter().filter(is_required).map(|field| field.name).collect();
        json.push_str(&format!(r#"}},"required":{},"additionalProperties":false"#, array(&required)));
        json
    }

    fn variants(&mut self, of: &EnumShape) -> String {
        let is_unit = |variant: &&StructShape| variant.fields.is_empty();
        let units: Vec<&str> = of.variants.iter().filter(is_unit).map(|variant| variant.name).collect();
        if units.len() == of.variants.len() {
            return match units.is_empty() {
                // No value at all.
                true => r#""not":{}"#.to_owned(),
                false => format!(r#""enum":{}"#, array(&units)),
            };
        }
        let mut choices = Vec::new();
        if !units.is_empty() {
            choices.push(format!(r#"{{"enum":{}}}"#, array(&units)));
        }
        for variant in of.variants.iter().filter(|variant| !variant.fields.is_empty()) {
            let fields = match Form::of(variant.fields) {
                Form::Transparent(shape) => self.schema(shape),
                // The fields of a variant are not a type of their own.
                Form::Empty | Form::Object(_) => format!("{{{}}}", self.object(variant.fields)),
            };
            let mut choice = r#"{"type":"object","properties":{"#.to_owned();
            text(variant.name, &mut choice);
            let required = array(&[variant.name]);
            choice.push_str(&format!(r#":{fields}}},"required":{required},"additionalProperties":false}}"#));
            choices.push(choice);
        }
        format!(r#""oneOf":[{}]"#, choices.join(","))
    }
}

/// The schema of a number with a range of its own, or of an option of one.
fn ranged(shape: Shape, of: FieldRange) -> String {
    let (minimum, maximum) = (of.minimum(), of.maximum());
    match (shape, range(shape)) {
        (Shape::Option(inner), _) => format!(r#"{{"anyOf":[{},{{"type":"null"}}]}}"#, ranged(*inner, of)),
        (_, Some(all)) => {
            let minimum = (minimum.ceil() as i128).max(*all.start());
            let maximum = (maximum.floor() as i128).min(*all.end());
            format!(r#"{{"type":"integer","minimum":{minimum},"maximum":{maximum}}}"#)
        }
        (_, None) => {
            let mut schema = r#"{"type":"number""#.to_owned();
            for (keyword, end) in [("minimum", minimum), ("maximum", maximum)] {
                if end.is_finite() {
                    schema.push_str(&format!(r#","{keyword}":{end}"#));
                }
            }
            schema + "}"
        }
    }
}

/// A schema in braces with what is known of the field: its doc comment and the unit of its numbers.
fn annotated(schema: String, field: &FieldShape) -> String {
    let mut notes = Vec::new();
    if !field.doc.is_empty() {
        notes.push(member("description", field.doc));
    }
    if let [unit] = field.units {
        notes.push(member("unit", unit.symbol));
    }
    match schema.strip_suffix('}') {
        Some(open) if !notes.is_empty() => format!("{open},{}}}", notes.join(",")),
        _ => schema,
    }
}

/// A member whose value is a text.
pub fn member(keyword: &str, value: &str) -> String {
    let mut json = String::new();
    text(keyword, &mut json);
    json.push(':');
    text(value, &mut json);
    json
}

fn array(texts: &[&str]) -> String {
    let mut json = "[".to_owned();
    for (index, item) in texts.iter().enumerate() {
        if index > 0 {
            json.push(',');
        }
        text(item, &mut json);
    }
    json.push(']');
    json
}
