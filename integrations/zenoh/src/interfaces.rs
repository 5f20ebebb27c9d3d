//! The types that ROS does not have, as a package that its users build.

use crate::counts::Ros2State;
use crate::services::{arguments, command_type};
use bb_core::message::Schema;
use bb_core::{Bus, Stamped};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// The package of types that ROS does not have.
const PACKAGE: &str = "bb_msgs";

/// Writes the package `bb_msgs` into a folder, for `colcon build`: a `.msg` for each payload of the robot's topics for which ROS has no message, and
/// a `.srv` for each command with arguments. Returns the files. Robots of one network with such types need one package for all.
///
/// # Errors
/// A file cannot be written, or two types of one name differ.
pub fn write_interfaces(robot: &Bus, folder: &Path) -> io::Result<Vec<PathBuf>> {
    let folder = folder.join(PACKAGE);
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
    let mut package = Package::default();
    for topic in &description.topics {
        if topic.layouts.ros_schema().is_none() {
            package.message(&topic.layouts.schema())?;
        }
    }
    package.message(&Stamped::<Ros2State>::LAYOUTS.schema())?;
    for command in &description.commands {
        let Some(shape) = arguments(command) else { continue };
        let name = command_type(command.path);
        let request = package.rest(&Schema::new(&format!("{name}_Request"), shape))?;
        let name = name.rsplit('/').next().unwrap_or(&name);
        package.add(format!("srv/{name}.srv"), format!("{request}---\nbool success\nstring message\n"))?;
    }
    let interfaces: Vec<&str> = package.files.keys().map(String::as_str).collect();
    let cmake = cmake(&interfaces, &package.needs);
    let manifest = manifest(&package.needs);
    package.files.insert("CMakeLists.txt".to_owned(), cmake);
    package.files.insert("package.xml".to_owned(), manifest);
    Ok(package.files)
}

/// The definitions so far, and the packages whose types they use.
#[derive(Default)]
struct Package {
    files: BTreeMap<String, String>,
    needs: BTreeSet<String>,
}

impl Package {
    /// Adds a message and all that it holds.
    fn message(&mut self, schema: &Schema) -> io::Result<()> {
        let body = self.rest(schema)?;
        let name = schema.name.rsplit('/').next().unwrap_or(&schema.name);
        self.add(format!("msg/{name}.msg"), body)
    }

    /// Adds what a definition holds, and returns the definition itself.
    fn rest(&mut self, schema: &Schema) -> io::Result<String> {
        let separator = "=".repeat(80);
        let mut parts = schema.text.split(&separator);
        let main = parts.next().unwrap_or_default().to_owned();
        self.note_packages(&main);
        for part in parts {
            let Some((name, body)) = part.trim_start().split_once('\n') else { continue };
            // Those of other packages are there.
            if let Some(name) = name.trim_start_matches("MSG: ").strip_prefix(&format!("{PACKAGE}/")) {
                self.note_packages(body);
                self.add(format!("msg/{name}.msg"), body.to_owned())?;
            }
        }
        Ok(main)
    }

    fn add(&mut self, file: String, contents: String) -> io::Result<()> {
        match self.files.get(&file) {
            Some(known) if *known != contents => {
                let message = format!(
                    "two types are named {file}: give one of them another name, `#[payload(name = \"…\")]`"
                );
                Err(io::Error::new(io::ErrorKind::AlreadyExists, message))
            }
            _ => {
                self.files.insert(file, contents);
                Ok(())
            }
        }
    }

    fn note_packages(&mut self, definition: &str) {
        let types = definition.lines().filter_map(|line| line.split_once('/'));
        self.needs.extend(types.map(|(package, _)| package.to_owned()).filter(|package| package != PACKAGE));
    }
}

fn cmake(interfaces: &[&str], needs: &BTreeSet<String>) -> String {
    let mut text =
        format!("cmake_minimum_required(VERSION 3.8)\nproject({PACKAGE})\n\nfind_package(ament_cmake REQUIRED)\n");
    text.push_str("find_package(rosidl_default_generators REQUIRED)\n");
    // Writing to a string cannot fail.
    for package in needs {
        let _ = writeln!(text, "find_package({package} REQUIRED)");
    }
    text.push_str("\nrosidl_generate_interfaces(${PROJECT_NAME}\n");
    for interface in interfaces {
        let _ = writeln!(text, "  \"{interface}\"");
    }
    if !needs.is_empty() {
        let needs: Vec<&str> = needs.iter().map(String::as_str).collect();
        let _ = writeln!(text, "  DEPENDENCIES {}", needs.join(" "));
    }
    text.push_str(")\n\nament_export_dependencies(rosidl_default_runtime)\nament_package()\n");
    text
}

fn manifest(needs: &BTreeSet<String>) -> String {
    let mut depends = String::new();
    for package in needs {
        let _ = writeln!(depends, "  <depend>{package}</depend>");
    }
    format!(
        "<?xml version=\"1.0\"?>\n<package format=\"3\">\n  <name>{PACKAGE}</name>\n  <version>0.0.0</version>\n  \
         <description>Types of a robot that ROS does not have</description>\n  \
         <maintainer email=\"robot@localhost\">the owner of the robot</maintainer>\n  <license>unknown</license>\n\n  \
         <buildtool_depend>ament_cmake</buildtool_depend>\n  <build_depend>rosidl_default_generators</build_depend>\n  \
         <exec_depend>rosidl_default_runtime</exec_depend>\n{depends}  \
         <member_of_group>rosidl_interface_packages</member_of_group>\n\n  \
         <export>\n    <build_type>ament_cmake</build_type>\n  </export>\n</package>\n"
    )
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

    mod other {
        use bb_core::Payload;

        #[derive(Clone, Debug, PartialEq, Payload)]
        pub(super) struct Plan {
            pub(super) other: bool,
        }
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

    #[test]
    fn two_types_of_one_name_are_refused() {
        let mut both = Package::default();
        both.message(&Stamped::<Plan>::LAYOUTS.schema()).expect("it is the first");
        both.message(&Stamped::<Plan>::LAYOUTS.schema()).expect("it is the same");
        let error = both.message(&Stamped::<other::Plan>::LAYOUTS.schema()).expect_err("it differs").to_string();
        assert!(error.starts_with("two types are named msg/Plan.msg"), "{error}");
    }
}
