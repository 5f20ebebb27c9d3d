//! `bb echo`: the messages of a topic.

use crate::topics::{TopicReader, find, open};
use crate::values::{Json, text};
use clap::Args;
use serde::Serialize;
use std::path::PathBuf;

/// Prints the messages of a topic.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// A recording or a ROS 2 bag.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// The topic.
    #[arg(value_name = "TOPIC")]
    topic: String,
    /// Prints at most this many messages.
    #[arg(long, value_name = "COUNT")]
    limit: Option<usize>,
    /// Prints one object per line, with complete lists and the log time.
    #[arg(long)]
    json: bool,
}

/// A line of `--json`.
#[derive(Serialize)]
struct Line<'a> {
    log_time_ns: u64,
    message: Json<'a>,
}

pub(super) fn run(arguments: &Arguments) -> Result<bool, String> {
    let bag = open(&arguments.file)?;
    let topic = find(&bag, &arguments.topic)?;
    let reader = TopicReader::new(topic).map_err(|fault| format!("{}: {fault}", arguments.file.display()))?;
    let messages = bag.messages_in_any_encoding(&[&topic.name]).map_err(|error| error.to_string())?;
    for message in messages.take(arguments.limit.unwrap_or(usize::MAX)) {
        let message = message.map_err(|error| error.to_string())?;
        let value = reader.read(&message)?;
        let printed = match arguments.json {
            true => {
                let line = Line { log_time_ns: message.log_time_ns, message: Json(&value) };
                serde_json::to_string(&line).map_err(|error| error.to_string())? + "\n"
            }
            false => text(&value, topic.is_own) + "---\n",
        };
        // The reader of a pipe may stop early.
        if !crate::say(&printed)? {
            break;
        }
    }
    Ok(true)
}
