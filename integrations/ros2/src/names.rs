//! Names of ROS 2, and those of a robot's paths.

use thiserror::Error;

/// The longest name of a topic or a service that every middleware accepts: 255 letters, less the prefixes of some.
const LONGEST_TOPIC: usize = 247;
const LONGEST_NAMESPACE: usize = 245;
const LONGEST_NODE: usize = 255;

/// A name that ROS 2 does not accept.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("`{name}` is no name of a {what}: {fault}")]
pub struct NameError {
    /// The name.
    pub name: String,
    /// Use of the name: `topic`, `service`, `node`, `namespace` or `parameter`.
    pub what: &'static str,
    /// The rule that it breaks.
    pub fault: String,
}

/// A node with its namespace.
///
/// ```
/// use bb_ros2::Node;
///
/// let node = Node::new("/site", "rover")?;
/// assert_eq!(node.full_name(), "/site/rover");
/// assert_eq!(node.topic("sensor/base/imu")?, "/site/sensor/base/imu");
/// assert_eq!(node.service("command/go_home")?, "/site/rover/go_home");
/// assert_eq!(
///     node.topic("mission/left-arm").unwrap_err().to_string(),
///     "`/site/mission/left-arm` is no name of a topic: `-` is not allowed, only letters, digits and `_` between slashes"
/// );
/// # Ok::<(), bb_ros2::NameError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Node {
    namespace: String,
    name: String,
}

impl Node {
    /// A node in a namespace, which is `/` or begins with a slash.
    ///
    /// # Errors
    /// One of the names is not valid.
    pub fn new(namespace: &str, name: &str) -> Result<Self, NameError> {
        if namespace != "/" {
            check(namespace, "namespace", LONGEST_NAMESPACE)?;
        }
        let error = |fault: &str| NameError { name: name.to_owned(), what: "node", fault: fault.to_owned() };
        if name.contains('/') {
            return Err(error("a node is named without slashes; its namespace is given apart"));
        }
        check_part(name).map_err(|fault| error(&fault))?;
        if name.len() > LONGEST_NODE {
            return Err(error(&too_long(LONGEST_NODE)));
        }
        Ok(Self { namespace: namespace.to_owned(), name: name.to_owned() })
    }

    /// The node of a robot, with the robot's name in small letters: `/site/left_arm` for `LeftArm`.
    ///
    /// # Errors
    /// The namespace is not valid.
    pub fn of_robot(namespace: &str, robot: &str) -> Result<Self, NameError> {
        let mut name = String::new();
        for letter in robot.chars() {
            if letter.is_uppercase() && name.ends_with(|last: char| !last.is_uppercase() && last != '_') {
                name.push('_');
            }
            name.push(letter);
        }
        Self::new(namespace, &name.to_lowercase())
    }

    /// The namespace: `/`, or one such as `/site`.
    pub fn namespace(&self) -> &str {
        &self.namespace
    }

    /// The name without its namespace.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The name below its namespace: `/site/rover`.
    pub fn full_name(&self) -> String {
        self.below_namespace(&self.name)
    }

    /// The topic for a path of the robot.
    ///
    /// # Errors
    /// The path has a letter that ROS does not allow, or is too long.
    pub fn topic(&self, path: &str) -> Result<String, NameError> {
        let name = self.below_namespace(path);
        check_topic(&name).map(|()| name)
    }

    /// The service for a command, `/site/rover/go` for `command/go`, or for a name of the node's own, such as `list_parameters`.
    ///
    /// # Errors
    /// The path has a letter that ROS does not allow, or is too long.
    pub fn service(&self, command: &str) -> Result<String, NameError> {
        let name = format!("{}/{}", self.full_name(), command.strip_prefix("command/").unwrap_or(command));
        check_service(&name).map(|()| name)
    }

    fn below_namespace(&self, name: &str) -> String {
        match self.namespace.as_str() {
            "/" => format!("/{name}"),
            namespace => format!("{namespace}/{name}"),
        }
    }
}

/// Checks the full name of a topic.
///
/// # Errors
/// The rule that it breaks.
pub fn check_topic(name: &str) -> Result<(), NameError> {
    check(name, "topic", LONGEST_TOPIC)
}

/// Checks the full name of a service.
///
/// # Errors
/// The rule that it breaks.
pub fn check_service(name: &str) -> Result<(), NameError> {
    check(name, "service", LONGEST_TOPIC)
}

fn check(name: &str, what: &'static str, longest: usize) -> Result<(), NameError> {
    let error = |fault: String| NameError { name: name.to_owned(), what, fault };
    let Some(parts) = name.strip_prefix('/') else {
        return Err(error("it does not begin with a slash".to_owned()));
    };
    for part in parts.split('/') {
        check_part(part).map_err(&error)?;
    }
    if name.len() > longest {
        return Err(error(too_long(longest)));
    }
    Ok(())
}

/// Checks what is between two slashes.
fn check_part(part: &str) -> Result<(), String> {
    if let Some(wrong) = part.chars().find(|letter| !letter.is_ascii_alphanumeric() && *letter != '_') {
        return Err(format!("`{wrong}` is not allowed, only letters, digits and `_` between slashes"));
    }
    match part.chars().next() {
        None => Err("a part of it is empty".to_owned()),
        Some(first) if first.is_ascii_digit() => Err(format!("`{part}` begins with a digit")),
        Some(_) => Ok(()),
    }
}

fn too_long(longest: usize) -> String {
    format!("it has more than {longest} letters")
}

/// The beginning of the paths of parameters.
const PARAMETERS: &str = "param/";

/// The name of a parameter in ROS, `gains.kp` for `param/gains/kp`; `None` for a path that is not a parameter's.
pub fn parameter_name(path: &str) -> Option<String> {
    path.strip_prefix(PARAMETERS).map(|path| path.replace('/', "."))
}

/// The path of a parameter of that name.
pub fn parameter_path(name: &str) -> String {
    format!("{PARAMETERS}{}", name.replace('.', "/"))
}
