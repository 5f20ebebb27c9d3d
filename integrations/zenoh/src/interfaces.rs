//! The types that ROS does not have, as a package that its users build.

use crate::counts::Ros2State;
use bb_core::message::Schema;
use bb_core::{Bus, Stamped};
use bb_ros2::{InterfaceError, Interfaces};
use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Writes the package `bb_msgs` into a folder, for `colcon build`: a `.msg` for each payload of the robot's topics for which ROS has no message, and
/// a `.srv` for each command with arguments. Returns the files. Robots of one network with such types need one package for all.
///
/// # Errors
/// A file cannot be written, or two types of one name differ.
pub fn write_interfaces(robot: &Bus, folder: &Path) -> io::Result<Vec<PathBuf>> {
    let folder = folder.join(Interfaces::PACKAGE);
    let mut files = Vec::new();
    for (name, contents) in package(robot)? {
        let path = folder.join(name);
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent)?;
        }
        fs::write(&path, contents)?;
        files.push(path);
    }
    Ok(files)
}

/// The files of the package, by their names in it.
fn package(robot: &Bus) -> io::Result<BTreeMap<String, String>> {
    let description = robot.description();
    let mut package = Interfaces::default();
    let mut add = |schema: Schema| package.add_message(&schema.name, &schema.text).map_err(exists);
    for topic in &description.topics {
        if topic.layouts.ros_schema().is_none() {
            add(topic.layouts.schema())?;
        }
    }
    add(Stamped::<Ros2State>::LAYOUTS.schema())?;
    for command in &description.commands {
        if let Some(definition) = command.argument_definition() {
            package.add_command(command.path, &definition).map_err(exists)?;
        }
    }
    Ok(package.files())
}

fn exists(error: InterfaceError) -> io::Error {
    io::Error::new(io::ErrorKind::AlreadyExists, error)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bb_core::prelude::*;

    #[derive(Clone, Copy, Debug, PartialEq, Payload)]
    enum Gear {
        Slow,
        Fast { speed: f64 },
    }

    #[derive(Clone, Debug, PartialEq, Payload)]
    struct Plan {
        gear: Gear,
        pose: Option<Pose>,
    }

    robot! {
        robot Planner;
        link base { sensor plan: External<Plan>(); sensor imu: External<Imu>(); }
    }

    #[test]
    fn the_package_has_what_ros_does_not_have() {
        let robot = Planner::builder().simulate().expect("it starts");
        let package = package(&robot).expect("no two differ");
        assert_eq!(
            package["msg/PlanStamped.msg"],
            "std_msgs/Header header\nint64 monotonic_time\nint64 wall_time\nstring robot\nstring node\nbb_msgs/Plan payload\n"
        );
        assert_eq!(package["msg/Plan.msg"].lines().next(), Some("bb_msgs/Gear gear"));
        assert_eq!(
            package["msg/Gear.msg"],
            "uint32 SLOW=0\nuint32 FAST=1\nuint32 kind\nbb_msgs/GearFast[<=1] fast\n"
        );
        assert!(!package.keys().any(|file| file.contains("Imu")), "ROS has it: {:?}", package.keys());
        assert!(
            package["CMakeLists.txt"].contains("  \"msg/GearFast.msg\"\n")
                && package["package.xml"].contains("<depend>std_msgs</depend>")
        );
    }
}
