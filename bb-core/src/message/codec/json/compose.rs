//! JSON put together from parts that are JSON already.

use super::to_json;

/// A string.
pub(crate) fn text(text: &str) -> String {
    to_json(&text.to_owned())
}

/// A number; `null` for what JSON has no number for.
pub(crate) fn number(number: f64) -> String {
    if number.is_finite() { to_json(&number) } else { null() }
}

/// `null`
pub(crate) fn null() -> String {
    "null".to_owned()
}

/// A value or `null`.
pub(crate) fn optional<T>(value: Option<T>, write: impl FnOnce(T) -> String) -> String {
    value.map_or_else(null, write)
}

/// An array of JSON values.
pub(crate) fn array(elements: &mut dyn Iterator<Item = String>) -> String {
    let mut json = "[".to_owned();
    for element in elements {
        separate(&mut json);
        json.push_str(&element);
    }
    json.push(']');
    json
}

/// An object of JSON values.
pub(crate) fn object(members: &[(&str, String)]) -> String {
    let mut json = "{".to_owned();
    for (name, value) in members {
        separate(&mut json);
        json.push_str(&text(name));
        json.push(':');
        json.push_str(value);
    }
    json.push('}');
    json
}

/// A comma, but not before the first.
fn separate(json: &mut String) {
    if json.len() > 1 {
        json.push(',');
    }
}
