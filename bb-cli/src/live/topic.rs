//! `bb topic`: topics of a running robot.

use super::connection::Robot;
use super::{Group, yaml};
use crate::commands::plot::{Series, picture, write};
use crate::say;
use bb_eval::table::aligned;
use bb_mcap::Value as Recorded;
use clap::Subcommand;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

#[derive(Debug, Subcommand)]
pub(crate) enum What {
    /// Prints all topics with their payloads and counts.
    List,
    /// Prints the messages of a topic: the newest, at most sixteen a second.
    Echo {
        /// The path, such as `sensor/base/imu`.
        path: String,
        /// Ends after so many.
        #[arg(long, value_name = "N")]
        limit: Option<u64>,
    },
    /// Prints the rates of topics, from the robot's own counts.
    Hz {
        /// The paths; by default all.
        paths: Vec<String>,
        /// Time to count, in seconds of the robot's clock.
        #[arg(long, default_value_t = 2.0, value_name = "S")]
        seconds: f64,
    },
    /// Plots fields of messages as they come: at most sixteen a second.
    Plot {
        /// Field of a topic with all numbers in it, such as `sensor/base/imu.angular_velocity`, or a whole topic.
        #[arg(value_name = "PATH[.FIELD]", required = true)]
        fields: Vec<String>,
        /// Length of the plot, in seconds of the robot's clock.
        #[arg(long, default_value_t = 10.0, value_name = "S")]
        seconds: f64,
        /// The SVG or PNG file to write; an existing one is replaced.
        #[arg(long, value_name = "FILE", value_parser = picture)]
        out: PathBuf,
    },
    /// Publishes a message, measured now, for a sensor or an input whose messages other code publishes. Needs the right `publish`, which the
    /// dashboard's option `rights` gives.
    Pub {
        /// The path, such as `sensor/base/sonar`.
        path: String,
        /// The payload, such as `{"range": 1.5}`, with all its fields.
        #[arg(value_name = "JSON")]
        payload: String,
    },
    /// Prints what is known of a topic.
    Info {
        /// The path, such as `sensor/base/imu`.
        path: String,
    },
}

pub(super) fn run(arguments: &Group<What>) -> Result<bool, String> {
    let as_json = arguments.live.json;
    let mut robot = arguments.live.connect()?;
    match &arguments.what {
        What::List => {
            let topics = robot.report()?["topics"].take();
            if as_json {
                return say(&format!("{topics}\n"));
            }
            let head = ["topic", "payload", "messages", "lost"].map(str::to_owned);
            let rows = topics.as_array().into_iter().flatten().map(|one| {
                let text = |name: &str| one[name].as_str().unwrap_or_default().to_owned();
                [text("path"), text("payload"), one["published"].to_string(), one["lost"].to_string()]
            });
            say(&aligned(&std::iter::once(head).chain(rows).collect::<Vec<_>>(), 2, usize::MAX))
        }
        What::Echo { path, limit } => echo(&mut robot, path, *limit, as_json),
        What::Hz { paths, seconds } => hz(&mut robot, paths, *seconds, as_json),
        What::Plot { fields, seconds, out } => plot(&mut robot, fields, *seconds, out, as_json),
        What::Pub { path, payload } => publish(&mut robot, path, payload, as_json),
        What::Info { path } => info(&mut robot, path, as_json),
    }
}

fn publish(robot: &mut Robot, path: &str, payload: &str, as_json: bool) -> Result<bool, String> {
    let payload: Value =
        serde_json::from_str(payload).map_err(|error| format!("the payload is not JSON: {error}: `{payload}`"))?;
    robot.ask("publish", json!({"path": path, "payload": payload}))?;
    say(&match as_json {
        true => format!("{}\n", json!({"path": path, "payload": payload})),
        false => format!("published at {path}\n"),
    })
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

/// A field that is plotted; its series begins with the first message.
struct Plotted {
    path: String,
    /// The type of ROS's message, which gives the units.
    ros: String,
    field: String,
    series: Option<Series>,
    messages: u64,
}

fn plot(robot: &mut Robot, fields: &[String], seconds: f64, out: &Path, as_json: bool) -> Result<bool, String> {
    let mut all = fields.iter().map(|field| plotted(robot, field)).collect::<Result<Vec<Plotted>, String>>()?;
    let paths: Vec<&str> = all.iter().map(|one| one.path.as_str()).collect();
    robot.ask("watch", json!({"paths": paths}))?;
    let mut span: Option<(f64, f64)> = None;
    while span.is_none_or(|(first, last)| last - first < seconds) {
        let frame = robot.next()?;
        if let Some(time) = frame["report"]["time"].as_f64() {
            span = Some((span.map_or(time, |(first, _)| first), time));
        }
        for one in &mut all {
            let Some(message) = frame["messages"].get(&one.path) else { continue };
            if let Some(bytes) = message["too_long"].as_u64() {
                return Err(format!("a message of {} is too long to be shown: {bytes} bytes as JSON", one.path));
            }
            let value = recorded(&message["payload"]);
            let series = match &mut one.series {
                Some(series) => series,
                None => one.series.insert(Series::new(&one.path, &one.ros, &value, &one.field)?),
            };
            series.add(message["monotonic_time"].as_i64().unwrap_or_default(), &value);
            one.messages += 1;
        }
    }
    let silent: Vec<&str> = all.iter().filter(|one| one.series.is_none()).map(|one| one.path.as_str()).collect();
    if !silent.is_empty() {
        return Err(format!("nothing came in {seconds} s from {}", silent.join(", ")));
    }
    let series: Vec<&Series> = all.iter().filter_map(|one| one.series.as_ref()).collect();
    write(robot.welcome["robot"].as_str().unwrap_or_default().to_owned(), &series, out)?;
    let counts: serde_json::Map<_, _> =
        fields.iter().zip(&all).map(|(field, one)| (field.clone(), one.messages.into())).collect();
    say(&match as_json {
        true => format!("{}\n", json!({"file": out, "messages": counts})),
        false => format!("plotted {}\n", out.display()),
    })
}

/// The topic and the field of `sensor/base/imu.angular_velocity`. A path may hold dots: the longest one that is a topic is taken.
fn plotted(robot: &Robot, text: &str) -> Result<Plotted, String> {
    let ends = text.match_indices('.').map(|(at, _)| at).chain([text.len()]);
    let is_topic = |end: &usize| robot.listed("topics").iter().any(|topic| topic["path"] == text[..*end]);
    let end = ends.rev().find(is_topic);
    let (path, field) = match end {
        Some(end) => (&text[..end], text[end..].trim_start_matches('.')),
        None => text.split_once('.').unwrap_or((text, "")),
    };
    let topic = robot.element("topics", "", path)?;
    let layout = topic["layout"].as_u64().and_then(|number| usize::try_from(number).ok());
    let ros = layout.and_then(|number| robot.listed("layouts").get(number)?["ros"]["name"].as_str());
    Ok(Plotted {
        path: topic["path"].as_str().unwrap_or_default().to_owned(),
        ros: ros.unwrap_or_default().to_owned(),
        field: field.to_owned(),
        series: None,
        messages: 0,
    })
}

/// JSON as a value of a recording.
fn recorded(value: &Value) -> Recorded {
    match value {
        Value::Null => Recorded::List(Vec::new()),
        Value::Bool(value) => Recorded::Bool(*value),
        Value::Number(number) => Recorded::F64(number.as_f64().unwrap_or(f64::NAN)),
        Value::String(text) if matches!(&**text, "NaN" | "Infinity" | "-Infinity") => Recorded::F64(f64::NAN),
        Value::String(text) => Recorded::Text(text.clone()),
        Value::Array(items) => Recorded::List(items.iter().map(recorded).collect()),
        Value::Object(members) => {
            Recorded::Message(members.iter().map(|(name, value)| (name.as_str().into(), recorded(value))).collect())
        }
    }
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
