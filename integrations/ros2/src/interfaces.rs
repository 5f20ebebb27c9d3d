//! The types that ROS does not have, as a package that its users build.

use crate::types::{TypeError, TypeName};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use thiserror::Error;

/// The package of types that ROS does not have.
const PACKAGE: &str = "bb_msgs";

/// The response of every service for a command: `success`, and the result in JSON or the reason of the refusal.
const OUTCOME: &str = "bool success\nstring message\n";

/// The package `bb_msgs` with the types of a robot that ROS does not have, for `colcon build`: a `.msg` for each message, a `.srv` for each command
/// with arguments. Robots of one network with such types need one package for all.
///
/// ```
/// use bb_ros2::Interfaces;
///
/// let mut interfaces = Interfaces::default();
/// interfaces.add_message("bb_msgs/msg/LevelStamped", "std_msgs/Header header\nfloat64 level\n")?;
/// interfaces.add_message("sensor_msgs/msg/Imu", "std_msgs/Header header\n")?;
/// interfaces.add_command("command/go_home", "float64 speed\n")?;
/// let files = interfaces.files();
/// let names: Vec<&str> = files.keys().map(String::as_str).collect();
/// assert_eq!(names, ["CMakeLists.txt", "msg/LevelStamped.msg", "package.xml", "srv/GoHome.srv"]);
/// assert_eq!(files["srv/GoHome.srv"], "float64 speed\n---\nbool success\nstring message\n");
/// # Ok::<(), bb_ros2::InterfaceError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Interfaces {
    files: BTreeMap<String, String>,
    needs: BTreeSet<String>,
}

/// A type that cannot be in the package.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum InterfaceError {
    /// The name of another type.
    #[error("two types are named {0}: give one of them another name, `#[payload(name = \"…\")]`")]
    SameName(String),
    /// A name that is not one of ROS's.
    #[error(transparent)]
    Name(#[from] TypeError),
}

impl Interfaces {
    /// The folder of the package.
    pub const PACKAGE: &str = PACKAGE;

    /// Adds a message of the package with all that it holds, by its definition as `ros2msg`, in which a line of `=` precedes each further type.
    /// Messages of other packages are left out.
    ///
    /// # Errors
    /// A name is not valid, or two types of one name differ. What was added before remains.
    pub fn add_message(&mut self, name: &str, definition: &str) -> Result<(), InterfaceError> {
        let Some(name) = own_name(name) else { return Ok(()) };
        let body = self.add_parts(definition)?;
        self.add("msg", name, body)
    }

    /// Adds the service for a command at a path, by the definition of its arguments.
    ///
    /// # Errors
    /// As [`Self::add_message`].
    pub fn add_command(&mut self, path: &str, arguments: &str) -> Result<(), InterfaceError> {
        let request = self.add_parts(arguments)?;
        let name = command_type(path);
        self.add("srv", name.rsplit('/').next().unwrap_or(&name), format!("{request}---\n{OUTCOME}"))
    }

    /// The files of the package, by their names in it, with those that its build needs.
    pub fn files(mut self) -> BTreeMap<String, String> {
        let interfaces: Vec<&str> = self.files.keys().map(String::as_str).collect();
        let cmake = cmake(&interfaces, &self.needs);
        let manifest = manifest(&self.needs);
        self.files.insert("CMakeLists.txt".to_owned(), cmake);
        self.files.insert("package.xml".to_owned(), manifest);
        self.files
    }

    /// Adds what a definition holds, and returns the definition itself.
    fn add_parts(&mut self, definition: &str) -> Result<String, InterfaceError> {
        let separator = "=".repeat(80);
        let mut parts = definition.split(&separator);
        let main = parts.next().unwrap_or_default().to_owned();
        self.note_packages(&main);
        for part in parts {
            let Some((name, body)) = part.trim_start().split_once('\n') else { continue };
            // Those of other packages are there.
            if let Some(name) = own_name(name.trim_start_matches("MSG: ")) {
                self.note_packages(body);
                self.add("msg", name, body.to_owned())?;
            }
        }
        Ok(main)
    }

    fn add(&mut self, kind: &str, name: &str, contents: String) -> Result<(), InterfaceError> {
        // A name is a part of a path, and a recording may come from anywhere.
        let _: TypeName = format!("{PACKAGE}/{kind}/{name}").parse()?;
        let file = format!("{kind}/{name}.{kind}");
        match self.files.get(&file) {
            Some(known) if *known != contents => Err(InterfaceError::SameName(file)),
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

/// The last part of the name of a message in the package, `bb_msgs/msg/Level` or `bb_msgs/Level`.
fn own_name(name: &str) -> Option<&str> {
    let name = name.strip_prefix(PACKAGE)?.strip_prefix('/')?;
    Some(name.strip_prefix("msg/").unwrap_or(name))
}

/// The type of the service for a command with arguments: `bb_msgs/srv/GoHome` for `command/go_home`.
pub fn command_type(path: &str) -> String {
    let path = path.strip_prefix("command/").unwrap_or(path);
    let mut name = String::new();
    for word in path.split(|letter: char| !letter.is_ascii_alphanumeric()) {
        let mut letters = word.chars();
        name.extend(letters.next().map(|first| first.to_ascii_uppercase()));
        name.push_str(letters.as_str());
    }
    format!("{PACKAGE}/srv/{name}")
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

    #[test]
    fn a_command_gives_its_service_a_valid_type() {
        for (path, expected) in
            [("command/go_home", "GoHome"), ("command/arm/reach", "ArmReach"), ("command/go", "Go")]
        {
            let name = command_type(path);
            assert_eq!(name, format!("bb_msgs/srv/{expected}"));
            assert!(name.parse::<TypeName>().is_ok());
        }
    }

    #[test]
    fn a_name_is_never_a_path_and_has_one_definition() {
        let line = "=".repeat(80);
        for name in ["../../evil", "a/b", "", "Level\0", "C:\\evil"] {
            let mut interfaces = Interfaces::default();
            let said = interfaces.add_message(&format!("bb_msgs/msg/{name}"), "bool a\n");
            assert!(matches!(said, Err(InterfaceError::Name(_))), "{name}: {said:?}");
            let held = format!("bb_msgs/A a\n{line}\nMSG: bb_msgs/{name}\nbool a\n");
            assert!(interfaces.add_message("bb_msgs/msg/B", &held).is_err(), "{name}");
            assert_eq!(interfaces.files().len(), 2, "{name}");
        }
        let mut interfaces = Interfaces::default();
        assert_eq!(interfaces.add_message("bb_msgs/msg/Level", "bool a\n"), Ok(()));
        assert_eq!(interfaces.add_message("bb_msgs/msg/Level", "bool a\n"), Ok(()));
        let said = interfaces.add_message("bb_msgs/msg/Level", "bool b\n").map_err(|error| error.to_string());
        assert!(said.is_err_and(|said| said.starts_with("two types are named msg/Level.msg")));
    }
}
