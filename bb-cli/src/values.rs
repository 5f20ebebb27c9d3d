//! Values of any type as JSON and as text.

use bb_mcap::Value;
use serde::de::{self, Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use serde::ser::{Serialize, SerializeMap, Serializer};
use std::fmt;

/// Number of elements after which a list printed as text is cut off.
const MOST_ELEMENTS: usize = 16;

/// A value as JSON: fields in order, and numbers that JSON cannot express as strings.
pub(crate) struct Json<'a>(pub(crate) &'a Value);

impl Serialize for Json<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0 {
            Value::Bool(value) => serializer.serialize_bool(*value),
            Value::Signed(value) => serializer.serialize_i64(*value),
            Value::Unsigned(value) => serializer.serialize_u64(*value),
            Value::Variant { name, .. } => serializer.serialize_str(name),
            Value::F32(value) if value.is_finite() => serializer.serialize_f32(*value),
            Value::F64(value) if value.is_finite() => serializer.serialize_f64(*value),
            Value::F32(value) => serializer.serialize_str(not_finite(f64::from(*value))),
            Value::F64(value) => serializer.serialize_str(not_finite(*value)),
            Value::Text(value) => serializer.serialize_str(value),
            Value::Bytes(bytes) => serializer.collect_seq(bytes),
            Value::List(values) => serializer.collect_seq(values.iter().map(Json)),
            Value::Message(fields) => {
                let mut map = serializer.serialize_map(Some(fields.len()))?;
                for (name, value) in fields {
                    map.serialize_entry(&**name, &Json(value))?;
                }
                map.end()
            }
        }
    }
}

fn not_finite(value: f64) -> &'static str {
    match value {
        f64::INFINITY => "Infinity",
        f64::NEG_INFINITY => "-Infinity",
        _ => "NaN",
    }
}

/// A value read from JSON: objects are messages, and `null` is NaN.
pub(crate) struct FromJson(pub(crate) Value);

impl<'de> Deserialize<'de> for FromJson {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(AnyValue).map(Self)
    }
}

struct AnyValue;

impl<'de> Visitor<'de> for AnyValue {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("JSON")
    }

    fn visit_bool<E>(self, value: bool) -> Result<Value, E> {
        Ok(Value::Bool(value))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Value, E> {
        Ok(Value::Signed(value))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Value, E> {
        Ok(Value::Unsigned(value))
    }

    fn visit_f64<E>(self, value: f64) -> Result<Value, E> {
        Ok(Value::F64(value))
    }

    fn visit_str<E: de::Error>(self, value: &str) -> Result<Value, E> {
        Ok(Value::Text(value.to_owned()))
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::F64(f64::NAN))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<Value, A::Error> {
        let mut values = Vec::new();
        while let Some(FromJson(value)) = sequence.next_element()? {
            values.push(value);
        }
        Ok(Value::List(values))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Value, A::Error> {
        let mut fields = Vec::new();
        while let Some((name, FromJson(value))) = map.next_entry::<String, _>()? {
            fields.push((name.into(), value));
        }
        Ok(Value::Message(fields))
    }
}

/// Formats a message as lines of text. In payloads, absent fields and the variants not in use are empty lists; `leaves_out_empty` omits
/// them.
pub(crate) fn text(value: &Value, leaves_out_empty: bool) -> String {
    let mut text = String::new();
    write_fields(value, leaves_out_empty, 0, &mut text);
    text
}

fn is_empty(value: &Value) -> bool {
    matches!(value, Value::List(values) if values.is_empty())
}

fn write_fields(value: &Value, leaves_out_empty: bool, depth: usize, text: &mut String) {
    let Value::Message(fields) = value else {
        *text += &format!("{}\n", inline(value));
        return;
    };
    for (name, value) in fields.iter().filter(|(_, value)| !(leaves_out_empty && is_empty(value))) {
        *text += &format!("{}{name}:", "  ".repeat(depth));
        match value {
            Value::Message(_) => {
                text.push('\n');
                write_fields(value, leaves_out_empty, depth + 1, text);
            }
            Value::List(values) if matches!(values.first(), Some(Value::Message(_))) => {
                text.push('\n');
                for value in values.iter().take(MOST_ELEMENTS) {
                    let mut element = String::new();
                    write_fields(value, leaves_out_empty, depth + 2, &mut element);
                    // The dash replaces the indentation of the first field.
                    let indent = "  ".repeat(depth + 1);
                    *text += &format!("{indent}- {}", element.trim_start());
                }
                if values.len() > MOST_ELEMENTS {
                    *text += &format!("{}# {} in all\n", "  ".repeat(depth + 1), values.len());
                }
            }
            _ => *text += &format!(" {}\n", inline(value)),
        }
    }
}

/// A value on one line.
fn inline(value: &Value) -> String {
    let list = |length: usize, shown: Vec<String>| match length > shown.len() {
        true => format!("[{}, …] # {length} in all", shown.join(", ")),
        false => format!("[{}]", shown.join(", ")),
    };
    match value {
        Value::Bool(value) => value.to_string(),
        Value::Signed(value) => value.to_string(),
        Value::Unsigned(value) => value.to_string(),
        Value::Variant { name, .. } => name.to_string(),
        Value::F32(value) => format!("{value:?}"),
        Value::F64(value) => format!("{value:?}"),
        Value::Text(value) => format!("{value:?}"),
        Value::Bytes(bytes) => list(bytes.len(), bytes.iter().take(MOST_ELEMENTS).map(u8::to_string).collect()),
        Value::List(values) => list(values.len(), values.iter().take(MOST_ELEMENTS).map(inline).collect()),
        Value::Message(fields) => {
            let fields: Vec<_> = fields.iter().map(|(name, value)| format!("{name}: {}", inline(value))).collect();
            format!("{{{}}}", fields.join(", "))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_keeps_the_order_and_what_is_no_number() {
        let text = r#"{"z":[1,-2,0.5],"a":{"name":"x","on":true}}"#;
        let FromJson(value) = serde_json::from_str(text).expect("it is JSON");
        assert_eq!(serde_json::to_string(&Json(&value)).expect("writes"), text);
        let list = Value::List(vec![Value::F32(f32::NAN), Value::F64(f64::NEG_INFINITY), Value::F32(0.1)]);
        assert_eq!(serde_json::to_string(&Json(&list)).expect("writes"), r#"["NaN","-Infinity",0.1]"#);
    }

    #[test]
    fn text_has_a_line_a_field() {
        let FromJson(value) =
            serde_json::from_str(r#"{"a":{"b":1},"list":[{"x":1,"y":2},{"x":3,"y":4}],"n":[1,2],"s":"t"}"#)
                .expect("it is JSON");
        assert_eq!(
            super::text(&value, false),
            "a:\n  b: 1\nlist:\n  - x: 1\n    y: 2\n  - x: 3\n    y: 4\nn: [1, 2]\ns: \"t\"\n"
        );
        let FromJson(variant) =
            serde_json::from_str(r#"{"a":{"b":[],"c":[1]},"list":[],"bytes":[]}"#).expect("it is JSON");
        assert_eq!(super::text(&variant, true), "a:\n  c: [1]\n");
        assert!(super::text(&variant, false).contains("list: []\n"));
        let long = Value::Message(vec![("n".into(), Value::Bytes((0..20).collect()))]);
        assert!(super::text(&long, false).ends_with("14, 15, …] # 20 in all\n"));
    }
}
