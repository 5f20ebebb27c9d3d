//! JSON objects written member by member into one text.

use super::write;
use std::fmt::Write as _;

/// An object that is being written.
#[derive(Debug)]
pub struct Object<'a>(&'a mut String);

/// One object.
pub fn object(write: impl FnOnce(&mut Object<'_>)) -> String {
    let mut json = String::new();
    enclosed(&mut json, write);
    json
}

impl Object<'_> {
    /// Writes a value that is JSON already.
    pub fn json(&mut self, name: &str, value: &str) {
        self.value_of(name).push_str(value);
    }

    /// Writes a text.
    pub fn text(&mut self, name: &str, value: &str) {
        write::text(value, self.value_of(name));
    }

    /// Writes a list of texts.
    pub fn texts(&mut self, name: &str, values: &[&str]) {
        self.array(name, values, |value, json| write::text(value, json));
    }

    /// Writes a Boolean.
    pub fn flag(&mut self, name: &str, value: bool) {
        self.json(name, if value { "true" } else { "false" });
    }

    /// Writes an integer.
    pub fn count(&mut self, name: &str, value: u64) {
        // Writing to a string cannot fail.
        let _ = write!(self.value_of(name), "{value}");
    }

    /// Writes a number; `null` for what JSON has no number for.
    pub fn number(&mut self, name: &str, value: f64) {
        number(value, self.value_of(name));
    }

    /// Writes a list of numbers, `null` for each that JSON has none for.
    pub fn numbers(&mut self, name: &str, values: &[f64]) {
        self.array(name, values, |value, json| number(*value, json));
    }

    /// Writes `null`.
    pub fn null(&mut self, name: &str) {
        self.json(name, "null");
    }

    /// Writes a text; `null` for none.
    pub fn optional_text(&mut self, name: &str, value: Option<&str>) {
        match value {
            Some(value) => self.text(name, value),
            None => self.null(name),
        }
    }

    /// Writes a number; `null` for none.
    pub fn optional_number(&mut self, name: &str, value: Option<f64>) {
        match value {
            Some(value) => self.number(name, value),
            None => self.null(name),
        }
    }

    /// Writes an object.
    pub fn object(&mut self, name: &str, write: impl FnOnce(&mut Object<'_>)) {
        enclosed(self.value_of(name), write);
    }

    /// Writes an array of objects.
    pub fn objects<T>(&mut self, name: &str, elements: &[T], write: fn(&T, &mut Object<'_>)) {
        self.array(name, elements, |element, json| enclosed(json, |object| write(element, object)));
    }

    fn array<T>(&mut self, name: &str, elements: &[T], write: impl Fn(&T, &mut String)) {
        let json = self.value_of(name);
        json.push('[');
        for (index, element) in elements.iter().enumerate() {
            if index > 0 {
                json.push(',');
            }
            write(element, json);
        }
        json.push(']');
    }

    /// Begins a member, and returns where its value is written.
    fn value_of(&mut self, name: &str) -> &mut String {
        // No value ends so: the object has just begun.
        if !self.0.ends_with('{') {
            self.0.push(',');
        }
        write::text(name, self.0);
        self.0.push(':');
        self.0
    }
}

fn enclosed(json: &mut String, write: impl FnOnce(&mut Object<'_>)) {
    json.push('{');
    write(&mut Object(json));
    json.push('}');
}

fn number(value: f64, json: &mut String) {
    match value.is_finite() {
        true => json.push_str(&format!("{value:?}")),
        false => json.push_str("null"),
    }
}
