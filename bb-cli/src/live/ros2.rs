//! `bb ros2`: files for programs of ROS 2.

use super::Group;
use super::connection::Robot;
use crate::{say, topics};
use bb_core::message::Schema;
use bb_ros2::Interfaces;
use clap::Subcommand;
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};

#[derive(Debug, Subcommand)]
pub(crate) enum What {
    /// Writes the package `bb_msgs`, for `colcon build`: a `.msg` for each payload that ROS has no message for, and a `.srv` for each command with
    /// arguments.
    Interfaces {
        /// The folder that gets the folder `bb_msgs`; files of the same names are replaced.
        #[arg(value_name = "DIR")]
        folder: PathBuf,
        /// Takes the payloads from a recording instead of a running robot. It has no commands, so there is no `.srv`.
        #[arg(long, value_name = "FILE", conflicts_with_all = ["robot", "name"])]
        recording: Option<PathBuf>,
    },
}

pub(super) fn run(arguments: &Group<What>) -> Result<bool, String> {
    let What::Interfaces { folder, recording } = &arguments.what;
    let interfaces = match recording {
        Some(file) => recorded(file)?,
        None => running(&arguments.live.connect()?)?,
    };
    let folder = folder.join(Interfaces::PACKAGE);
    let files = interfaces.files();
    for (name, contents) in &files {
        let path = folder.join(name);
        let failed = |error| format!("{}: {error}", path.display());
        path.parent().map_or(Ok(()), fs::create_dir_all).map_err(failed)?;
        fs::write(&path, contents).map_err(failed)?;
    }
    say(&match arguments.live.json {
        true => format!("{}\n", json!({"folder": folder, "files": files.keys().collect::<Vec<_>>()})),
        false => files.keys().map(|name| format!("{}\n", folder.join(name).display())).collect(),
    })
}

/// The types of a recording's topics.
fn recorded(file: &Path) -> Result<Interfaces, String> {
    let bag = topics::open(file)?;
    let mut interfaces = Interfaces::default();
    // A payload that ROS has a message for is written a second time in its exact layout, which only this project reads.
    let is_for_ros = |name: &str| !name.ends_with("/_exact");
    for topic in bag.topics().iter().filter(|topic| is_for_ros(&topic.name)) {
        if *topic.definition_encoding == *Schema::ENCODING {
            let added = interfaces.add_message(&topic.schema, &topic.definition);
            added.map_err(|error| format!("{}: {}: {error}", file.display(), topic.name))?;
        }
    }
    Ok(interfaces)
}

/// The types of a running robot's topics, and its commands.
fn running(robot: &Robot) -> Result<Interfaces, String> {
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let mut interfaces = Interfaces::default();
    for layout in robot.listed("layouts").iter().filter(|layout| layout["ros"].is_null()) {
        let (name, definition) = (text(&layout["exact"]["name"]), text(&layout["exact"]["definition"]));
        interfaces.add_message(&name, &definition).map_err(|error| error.to_string())?;
    }
    for command in robot.listed("commands") {
        if let Some(definition) = command["definition"].as_str() {
            let path = text(&command["path"]);
            interfaces.add_command(&path, definition).map_err(|error| format!("{path}: {error}"))?;
        }
    }
    Ok(interfaces)
}
