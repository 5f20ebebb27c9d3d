//! The words of errors: what was expected, what was found, and the nearest name.

use super::write::text;
use super::{Form, JsonError, range};
use crate::message::codec::{FieldShape, Shape};
use crate::message::nearest::nearest;
use serde_json::value::RawValue;
use std::fmt;

pub(super) fn unknown(fields: &[FieldShape], name: String) -> JsonError {
    let names: Vec<&str> = fields.iter().map(|field| field.name).collect();
    let hint = match did_you_mean(&names, &name) {
        hint if !hint.is_empty() => hint,
        _ if names.is_empty() => "; there are no fields".to_owned(),
        _ => format!("; the fields are {}", names.join(", ")),
    };
    JsonError::new(format!("unknown field{hint}")).within(Shortened(&name).to_string())
}

pub(super) fn did_you_mean(names: &[&str], name: &str) -> String {
    let near = names.iter().find(|near| near.eq_ignore_ascii_case(name)).copied();
    let near = near.or_else(|| nearest(name, names.iter().copied()));
    near.map_or(String::new(), |near| format!("; did you mean `{near}`?"))
}

pub(super) fn mismatch(shape: Shape, value: &RawValue) -> JsonError {
    JsonError::mismatch(expected(shape), found(value))
}

/// Describes the values of a shape in the words of JSON.
pub(super) fn expected(shape: Shape) -> String {
    if let Some(range) = range(shape) {
        return format!("an integer from {} to {}", range.start(), range.end());
    }
    match shape {
        Shape::Bool => "true or false".into(),
        Shape::Char => "text of one character".into(),
        Shape::Text => "text".into(),
        Shape::Option(of) => format!("{} or null", expected(*of)),
        Shape::List(_) => "an array".into(),
        Shape::Array(_, length) => format!("an array of {length}"),
        Shape::Struct(of) => match Form::of(of.fields) {
            Form::Transparent(shape) => expected(shape),
            Form::Empty | Form::Object(_) => "an object".into(),
        },
        Shape::Enum(of) => {
            let names: Vec<String> = of.variants.iter().map(|variant| Quoted(variant.name).to_string()).collect();
            match names.as_slice() {
                [] => "nothing, since there are no variants".into(),
                [name] => name.clone(),
                names => format!("one of {}", names.join(", ")),
            }
        }
        // Integers are above.
        _ => "a number".into(),
    }
}

pub(super) fn found(value: &RawValue) -> String {
    match value.get() {
        object if object.starts_with('{') => "an object".to_owned(),
        array if array.starts_with('[') => "an array".to_owned(),
        text if text.starts_with('"') => format!("the text {}", Shortened(text)),
        other => Shortened(other).to_string(),
    }
}

/// Text in quotes, as in JSON.
pub(super) struct Quoted<'a>(pub(super) &'a str);

impl fmt::Display for Quoted<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut quoted = String::new();
        text(self.0, &mut quoted);
        Shortened(&quoted).fmt(f)
    }
}

/// The beginning of what was found, short enough for an error.
pub(super) struct Shortened<'a>(pub(super) &'a str);

impl fmt::Display for Shortened<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        /// Longest text shown, in characters.
        const MOST: usize = 40;
        match self.0.char_indices().nth(MOST) {
            Some((end, _)) => write!(f, "{}…", &self.0[..end]),
            None => f.write_str(self.0),
        }
    }
}
