//! `bb param`: parameters of a running robot.

use super::Group;
use super::connection::Robot;
use crate::say;
use bb_eval::table::aligned;
use clap::Subcommand;
use serde_json::{Value, json};

#[derive(Debug, Subcommand)]
pub(crate) enum What {
    /// Prints all parameters with their values, in SI.
    List,
    /// Prints the value of one.
    Get {
        /// The path, such as `param/speed`, or `speed`.
        path: String,
    },
    /// Sets parameters all at once, or none of them if one is refused.
    Set {
        /// The paths and values, such as `speed=0.5`. Numbers are in SI.
        #[arg(required = true, value_name = "PATH=VALUE")]
        values: Vec<String>,
    },
}

pub(super) fn run(arguments: &Group<What>) -> Result<bool, String> {
    let mut robot = arguments.live.connect()?;
    match &arguments.what {
        What::List if arguments.live.json => say(&format!("{}\n", robot.description()["parameters"])),
        What::List => say(&table(robot.listed("parameters"))),
        What::Get { path } => {
            let found = robot.element("parameters", "param/", path)?;
            let text = if arguments.live.json {
                json!({"path": found["path"], "value": found["value"]})
            } else {
                found["value"].clone()
            };
            say(&format!("{text}\n"))
        }
        What::Set { values } => {
            let values =
                values.iter().map(|text| value(&robot, text)).collect::<Result<serde_json::Map<_, _>, _>>()?;
            let values = Value::Object(values);
            robot.ask("set", json!({"values": values}))?;
            if arguments.live.json {
                return say(&format!("{values}\n"));
            }
            let lines = values.as_object().into_iter().flatten().map(|(path, value)| format!("{path} = {value}\n"));
            say(&lines.collect::<String>())
        }
    }
}

/// The path and the value of `speed=0.5`, by the parameter's type.
fn value(robot: &Robot, text: &str) -> Result<(String, Value), String> {
    let (path, value) = text.split_once('=').ok_or_else(|| format!("expected PATH=VALUE, found `{text}`"))?;
    let parameter = robot.element("parameters", "param/", path.trim())?;
    let path = parameter["path"].as_str().unwrap_or_default().to_owned();
    let value = match parameter["type"].as_str() {
        Some("String") => Value::from(value),
        Some(kind) => serde_json::from_str(value.trim())
            .map_err(|_| format!("{path} is not set: expected a value of type `{kind}`, found `{value}`"))?,
        None => Value::Null,
    };
    Ok((path, value))
}

fn table(parameters: &[Value]) -> String {
    let head = ["parameter", "value", "unit", "range", "about"].map(str::to_owned);
    let text = |value: &Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
    let rows = parameters.iter().map(|one| {
        let range = match (&one["minimum"], &one["maximum"]) {
            (Value::Null, Value::Null) => String::new(),
            (low, high) => format!("{low}..={high}"),
        };
        [text(&one["path"]), one["value"].to_string(), text(&one["unit"]), range, text(&one["doc"])]
    });
    let rows: Vec<_> = std::iter::once(head).chain(rows).collect();
    aligned(&rows, 5, usize::MAX)
}
