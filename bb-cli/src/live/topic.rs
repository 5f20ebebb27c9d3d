//! `bb topic`: topics of a running robot.

use super::connection::Robot;
use super::{Where, yaml};
use crate::say;
use bb_eval::table::aligned;
use clap::{Args, Subcommand};
use serde_json::{Value, json};

/// Lists topics of a running robot, and prints their messages and rates.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    at: Where,
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Prints all topics with their payloads and counts.
    List {
        /// Prints an array of objects instead of the table.
        #[arg(long)]
        json: bool,
    },
    /// Prints the messages of a topic: the newest, at most sixteen a second.
    Echo {
        /// The path, such as `sensor/base/imu`.
        path: String,
        /// Ends after so many.
        #[arg(long, value_name = "N")]
        limit: Option<u64>,
        /// Prints an object on each line, with its stamp.
        #[arg(long)]
        json: bool,
    },
    /// Prints the rates of topics, from the robot's own counts.
    Hz {
        /// The paths; by default all.
        paths: Vec<String>,
        /// How long to count, in seconds of the robot's clock.
        #[arg(long, default_value_t = 2.0, value_name = "S")]
        seconds: f64,
        /// Prints an array of objects instead of the table.
        #[arg(long)]
        json: bool,
    },
    /// Prints what is known of a topic.
    Info {
        /// The path, such as `sensor/base/imu`.
        path: String,
        /// Prints an object instead of lines.
        #[arg(long)]
        json: bool,
    },
}

pub(super) fn run(arguments: &Arguments) -> Result<bool, String> {
    let mut robot = arguments.at.connect()?;
    match &arguments.what {
        What::List { json } => {
            let topics = robot.report()?["topics"].take();
            if *json {
                return say(&format!("{topics}\n"));
            }
            let head = ["topic", "payload", "messages", "lost"].map(str::to_owned);
            let rows = topics.as_array().into_iter().flatten().map(|one| {
                let text = |name: &str| one[name].as_str().unwrap_or_default().to_owned();
                [text("path"), text("payload"), one["published"].to_string(), one["lost"].to_string()]
            });
            say(&aligned(&std::iter::once(head).chain(rows).collect::<Vec<_>>(), 2, usize::MAX))
        }
        What::Echo { path, limit, json } => echo(&mut robot, path, *limit, *json),
        What::Hz { paths, seconds, json } => hz(&mut robot, paths, *seconds, *json),
        What::Info { path, json } => info(&mut robot, path, *json),
    }
}

fn echo(robot: &mut Robot, path: &str, limit: Option<u64>, as_json: bool) -> Result<bool, String> {
    let path = robot.element("topics", "", path)?["path"].as_str().unwrap_or_default().to_owned();
    robot.ask("watch", json!({"paths": [path]}))?;
    let mut printed = 0;
    while limit.is_none_or(|limit| printed < limit) {
        let frame = robot.next()?;
        let Some(message) = frame["messages"].get(&path) else { continue };
        if let Some(bytes) = message["too_long"].as_u64() {
            return Err(format!("a message of {path} is too long to be shown: {bytes} bytes as JSON"));
        }
        printed += 1;
        let mut text = String::new();
        if as_json {
            text = format!("{message}\n");
        } else {
            yaml::lines(&message["payload"], 0, &mut text);
            text.push_str("---\n");
        }
        if !say(&text)? {
            return Ok(false);
        }
    }
    Ok(true)
}

fn hz(robot: &mut Robot, paths: &[String], seconds: f64, as_json: bool) -> Result<bool, String> {
    let paths = paths.iter().map(|path| Ok(robot.element("topics", "", path)?["path"].clone()));
    let paths = paths.collect::<Result<Vec<Value>, String>>()?;
    let first = robot.report()?;
    let start = time(&first);
    let last = loop {
        let report = robot.report()?;
        if time(&report) - start >= seconds {
            break report;
        }
    };
    let span = time(&last) - start;
    let rates: Vec<Value> = rates(&first, &last)
        .filter(|(path, _)| paths.is_empty() || paths.contains(path))
        .map(|(path, messages)| json!({"topic": path, "messages": messages, "seconds": span, "rate_hz": messages as f64 / span}))
        .collect();
    if as_json {
        return say(&format!("{}\n", Value::Array(rates)));
    }
    let head = ["topic", "messages", "Hz"].map(str::to_owned);
    let rows = rates.iter().map(|one| {
        let rate = one["rate_hz"].as_f64().unwrap_or_default();
        [one["topic"].as_str().unwrap_or_default().to_owned(), one["messages"].to_string(), format!("{rate:.2}")]
    });
    say(&aligned(&std::iter::once(head).chain(rows).collect::<Vec<_>>(), 1, usize::MAX))
}

fn time(report: &Value) -> f64 {
    report["time"].as_f64().unwrap_or_default()
}

/// The messages of each topic between two reports.
pub(super) fn rates<'a>(first: &'a Value, last: &'a Value) -> impl Iterator<Item = (Value, u64)> + 'a {
    last["topics"].as_array().into_iter().flatten().map(|topic| {
        let before = first["topics"].as_array().into_iter().flatten().find(|other| other["path"] == topic["path"]);
        let count = |topic: &Value| topic["published"].as_u64().unwrap_or_default();
        (topic["path"].clone(), count(topic).saturating_sub(before.map_or(0, count)))
    })
}

fn info(robot: &mut Robot, path: &str, as_json: bool) -> Result<bool, String> {
    let topic = robot.element("topics", "", path)?.clone();
    let report = robot.report()?;
    let counts = report["topics"].as_array().into_iter().flatten().find(|one| one["path"] == topic["path"]);
    let counts = counts.cloned().unwrap_or_default();
    let components = robot.listed("components");
    let by = components.iter().find(|one| {
        one["path"] == topic["path"]
            || one["topics"].as_array().is_some_and(|topics| topics.contains(&topic["path"]))
    });
    let takers: Vec<&Value> = components
        .iter()
        .filter(|one| one["inputs"].as_array().into_iter().flatten().any(|input| input["source"] == topic["path"]))
        .map(|one| &one["path"])
        .collect();
    let of = json!({
        "path": topic["path"],
        "payload": topic["payload"],
        "declared_rate_hz": topic["rate_hz"],
        "published_by": by.map(|one| &one["path"]),
        "taken_by": takers,
        "published": counts["published"],
        "lost": counts["lost"],
        "subscribers": counts["subscribers"],
    });
    if as_json {
        return say(&format!("{of}\n"));
    }
    let mut text = String::new();
    yaml::lines(&of, 0, &mut text);
    say(&text)
}
