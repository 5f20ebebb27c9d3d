//! The package of a robot's own types, for ROS itself to hash: run by `tests/ros2/check`, which names the folder.

use bb_core::message::codec::{Field, service_hash};
use bb_core::prelude::*;
use bb_ros2::{Interfaces, command_type};
use serde_json::json;
use std::error::Error;
use std::path::PathBuf;

/// One of everything.
#[derive(Clone, Debug, PartialEq, Payload)]
struct Everything {
    small: i8,
    byte: u8,
    middle: [i16; 3],
    numbers: Vec<u16>,
    large: i32,
    larger: u32,
    largest: i64,
    bytes: Vec<u8>,
    count: u64,
    single: f32,
    is_on: bool,
    text: String,
    texts: Vec<String>,
    rows: Vec<Vec<f64>>,
    maybe: Option<f64>,
    gear: Gear,
    gears: Vec<Gear>,
    poses: Vec<Pose>,
    imu: Option<Imu>,
    nested: Nested,
    turn: Duration,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Payload)]
enum Gear {
    #[default]
    Slow,
    Fast {
        speed: f64,
    },
    Both(f64, bool),
}

#[derive(Clone, Debug, Default, PartialEq, Payload)]
struct Nested {
    gear: Option<Gear>,
    names: [String; 2],
}

#[derive(Clone, Debug, Default, Payload)]
struct Plan {
    gear: Gear,
    speeds: Vec<f64>,
    nested: Option<Nested>,
}

#[derive(Debug)]
struct Go;

impl Command for Go {
    type Options = NoOptions;
    type Arguments = Plan;
    type Output = f64;

    async fn run(_: NoOptions, _: Plan, _: CommandContext) -> Result<Outcome<f64>, Fault> {
        Ok(Outcome::done(0.0))
    }
}

robot! {
    robot Rig;
    commands { go_far: Go; }
    link base {
        sensor everything: External<Everything>();
        sensor gear: External<Gear>();
        sensor imu: External<Imu>();
    }
}

/// The response of the services.
#[derive(Clone, Debug, Payload)]
struct Response {
    #[allow(dead_code)]
    success: bool,
    #[allow(dead_code)]
    message: String,
}

/// Writes the package, and the hash of each type as the robot has it.
#[test]
#[ignore = "tests/ros2/check runs it"]
fn interfaces_for_ros() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::var_os("BB_ROS2_FOLDER").ok_or("tests/ros2/check names the folder")?);
    let rig = Rig::builder().simulate()?;
    let description = rig.description();
    let (mut interfaces, mut hashes) = (Interfaces::default(), Vec::new());
    for topic in description.topics.iter().filter(|topic| topic.layouts.ros_schema().is_none()) {
        let schema = topic.layouts.schema();
        interfaces.add_message(&schema.name, &schema.text)?;
        hashes.push(json!({"name": schema.name, "hash": topic.layouts.type_hash()}).to_string());
    }
    let go = description.command("command/go_far").ok_or("the robot has it")?;
    interfaces.add_command(go.path, &go.argument_definition().ok_or("it has arguments")?)?;
    let name = command_type(go.path);
    let hash = service_hash(&name, go.arguments, Response::SHAPE);
    hashes.push(json!({"name": name, "hash": hash}).to_string());
    for (name, contents) in interfaces.files() {
        let path = folder.join(Interfaces::PACKAGE).join(name);
        std::fs::create_dir_all(path.parent().ok_or("it is in the folder")?)?;
        std::fs::write(path, contents)?;
    }
    std::fs::write(folder.join("interfaces.jsonl"), hashes.join("\n"))?;
    Ok(())
}
