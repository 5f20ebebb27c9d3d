//! JSON values as indented lines, like those of `bb echo`.

use serde_json::Value;

/// Appends the lines of a value, indented by `depth` steps.
pub(super) fn lines(value: &Value, depth: usize, text: &mut String) {
    let indent = "  ".repeat(depth);
    let Value::Object(members) = value else {
        text.push_str(&format!("{indent}{value}\n"));
        return;
    };
    for (name, member) in members {
        match member {
            Value::Object(inner) if !inner.is_empty() => {
                text.push_str(&format!("{indent}{name}:\n"));
                lines(member, depth + 1, text);
            }
            Value::Array(list) if list.iter().any(Value::is_object) => {
                text.push_str(&format!("{indent}{name}:\n"));
                for element in list {
                    text.push_str(&format!("{indent}- {element}\n"));
                }
            }
            other => text.push_str(&format!("{indent}{name}: {other}\n")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_value_is_a_line_for_each_number() {
        let mut text = String::new();
        lines(
            &json!({"position": {"x": 1.5, "y": null}, "list": [1, 2], "of": [{"a": 1}], "name": "b"}),
            0,
            &mut text,
        );
        assert_eq!(text, "list: [1,2]\nname: \"b\"\nof:\n- {\"a\":1}\nposition:\n  x: 1.5\n  y: null\n");
    }
}
