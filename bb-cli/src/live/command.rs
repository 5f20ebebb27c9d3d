//! `bb command`: commands of a running robot.

use super::Group;
use crate::say;
use bb_eval::table::aligned;
use clap::Subcommand;
use serde_json::{Value, json};

#[derive(Debug, Subcommand)]
pub(crate) enum What {
    /// Prints all commands with their arguments, and what runs.
    List,
    /// Starts one, waits for its end and prints its result. If this is interrupted, the command runs on.
    Run {
        /// The path, such as `command/drive`, or `drive`.
        path: String,
        /// The arguments as a JSON object; by default those of the command.
        arguments: Option<String>,
        /// Prints the number of the execution, and does not wait.
        #[arg(long)]
        detach: bool,
    },
    /// Cancels a running command, also one that another client has started.
    Cancel {
        /// The number of the execution, as `bb command list` and `bb top` print it.
        execution: u64,
    },
}

pub(super) fn run(arguments: &Group<What>) -> Result<bool, String> {
    let mut robot = arguments.live.connect()?;
    match &arguments.what {
        What::List => {
            let executions = robot.report()?["executions"].take();
            if arguments.live.json {
                let commands = &robot.description()["commands"];
                return say(&format!("{}\n", json!({"commands": commands, "executions": executions})));
            }
            say(&(table(robot.listed("commands")) + &running(&executions)))
        }
        What::Run { path, arguments: of, detach } => {
            let path = robot.element("commands", "command/", path)?["path"].clone();
            let mut ask = json!({"path": path});
            if let Some(of) = of {
                ask["arguments"] =
                    serde_json::from_str(of).map_err(|error| format!("the arguments are not JSON: {error}"))?;
            }
            let execution = robot.ask("start", ask)?["execution"].clone();
            if *detach {
                let text = if arguments.live.json {
                    json!({"execution": execution}).to_string()
                } else {
                    execution.to_string()
                };
                return say(&format!("{text}\n"));
            }
            loop {
                let message = robot.next()?;
                if message["op"] != "result" || message["execution"] != execution {
                    continue;
                }
                if let Some(error) = message["error"].as_str() {
                    return Err(error.to_owned());
                }
                let value = &message["value"];
                let text = if arguments.live.json {
                    json!({"execution": execution, "value": value})
                } else {
                    value.clone()
                };
                return say(&format!("{text}\n"));
            }
        }
        What::Cancel { execution } => {
            robot.ask("cancel", json!({"execution": execution}))?;
            say(&if arguments.live.json {
                format!("{}\n", json!({"cancelled": execution}))
            } else {
                "cancelled\n".to_owned()
            })
        }
    }
}

fn table(commands: &[Value]) -> String {
    let head = ["command", "in the states", "arguments"].map(str::to_owned);
    let rows = commands.iter().map(|one| {
        let states = one["allowed_states"].as_array().map(|states| {
            let names: Vec<&str> = states.iter().filter_map(Value::as_str).collect();
            names.join(", ")
        });
        let by_role = match one["role"].as_str() {
            Some("arming") => "disarmed",
            Some("disarming") => "all but disarmed",
            _ => "idle",
        };
        let defaults = &one["defaults"];
        let defaults = if defaults.as_object().is_none_or(|all| all.is_empty()) {
            String::new()
        } else {
            defaults.to_string()
        };
        let path = one["path"].as_str().unwrap_or_default().to_owned();
        [path, states.unwrap_or_else(|| by_role.to_owned()), defaults]
    });
    let rows: Vec<_> = std::iter::once(head).chain(rows).collect();
    aligned(&rows, 3, usize::MAX)
}

/// Formats the progress of an execution, after a comma: `, share 0.25`; empty if it does not say.
pub(super) fn progress(progress: &Value) -> String {
    match progress {
        Value::Null => String::new(),
        Value::Object(fields) => fields.iter().map(|(name, value)| format!(", {name} {value}")).collect(),
        value => format!(", {value}"),
    }
}

fn running(executions: &Value) -> String {
    let all = executions.as_array().map_or(&[][..], Vec::as_slice);
    if all.is_empty() {
        return "\nnothing runs\n".to_owned();
    }
    let lines = all.iter().map(|one| {
        let text = |name: &str| one[name].as_str().unwrap_or_default();
        let progress = progress(&one["progress"]);
        format!("runs: {} {}, started by {}{progress}\n", one["number"], text("path"), text("caller"))
    });
    format!("\n{}", lines.collect::<String>())
}
