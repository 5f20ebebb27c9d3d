//! Names and hashes of types.

use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// The name of a message or a service: `sensor_msgs/msg/Imu`.
///
/// ```
/// use bb_ros2::TypeName;
///
/// let imu: TypeName = "sensor_msgs/msg/Imu".parse()?;
/// assert_eq!(imu.in_dds(), "sensor_msgs::msg::dds_::Imu_");
/// assert_eq!(TypeName::from_dds("sensor_msgs::msg::dds_::Imu_")?, imu);
/// # Ok::<(), bb_ros2::TypeError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct TypeName {
    package: String,
    kind: Kind,
    name: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Kind {
    Message,
    Service,
    /// Services and messages of actions: `example_interfaces/action/Fibonacci_SendGoal`.
    Action,
}

impl Kind {
    const ALL: [(Self, &str); 3] = [(Self::Message, "msg"), (Self::Service, "srv"), (Self::Action, "action")];

    fn name(self) -> &'static str {
        Self::ALL[self as usize].1
    }
}

/// A text that is not the name or the hash of a type.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("`{0}` is no {1}")]
pub struct TypeError(String, &'static str);

impl TypeName {
    /// The name of a type from its name in keys, `sensor_msgs::msg::dds_::Imu_`.
    ///
    /// # Errors
    /// The text has another form.
    pub fn from_dds(text: &str) -> Result<Self, TypeError> {
        let error = || TypeError(text.to_owned(), "type in DDS's form, such as `sensor_msgs::msg::dds_::Imu_`");
        let (rest, name) = text.strip_suffix('_').and_then(|text| text.split_once("::dds_::")).ok_or_else(error)?;
        let (package, kind) = rest.split_once("::").ok_or_else(error)?;
        Self::new(package, kind, name).ok_or_else(error)
    }

    /// The name in keys.
    pub fn in_dds(&self) -> String {
        format!("{}::{}::dds_::{}_", self.package, self.kind.name(), self.name)
    }

    fn new(package: &str, kind: &str, name: &str) -> Option<Self> {
        let is_word = |word: &str| {
            word.starts_with(|first: char| first.is_ascii_alphabetic())
                && word.chars().all(|letter| letter.is_ascii_alphanumeric() || letter == '_')
        };
        let (kind, _) = Kind::ALL.into_iter().find(|(_, name)| *name == kind)?;
        (is_word(package) && is_word(name)).then(|| Self {
            package: package.to_owned(),
            kind,
            name: name.to_owned(),
        })
    }
}

impl FromStr for TypeName {
    type Err = TypeError;

    fn from_str(text: &str) -> Result<Self, TypeError> {
        let mut parts = text.split('/');
        let found = match (parts.next(), parts.next(), parts.next(), parts.next()) {
            (Some(package), Some(kind), Some(name), None) => Self::new(package, kind, name),
            _ => None,
        };
        found.ok_or_else(|| TypeError(text.to_owned(), "name of a type, such as `sensor_msgs/msg/Imu`"))
    }
}

impl fmt::Display for TypeName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}/{}", self.package, self.kind.name(), self.name)
    }
}

/// The hash by which ROS 2 tells types of one name apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TypeHash {
    /// SHA-256 of the description, since Iron.
    Rihs01([u8; 32]),
    /// None, as Humble writes it.
    Unsupported,
}

const PREFIX: &str = "RIHS01_";
const UNSUPPORTED: &str = "TypeHashNotSupported";

impl FromStr for TypeHash {
    type Err = TypeError;

    fn from_str(text: &str) -> Result<Self, TypeError> {
        if text == UNSUPPORTED {
            return Ok(Self::Unsupported);
        }
        let bytes = text.strip_prefix(PREFIX).and_then(bytes_of);
        bytes.map(Self::Rihs01).ok_or_else(|| TypeError(text.to_owned(), "hash of a type"))
    }
}

/// The bytes of that many hexadecimal digits in small letters.
fn bytes_of(digits: &str) -> Option<[u8; 32]> {
    let mut bytes = [0; 32];
    if digits.len() != 2 * bytes.len() {
        return None;
    }
    let digit = |letter: u8| match letter {
        b'0'..=b'9' => Some(letter - b'0'),
        b'a'..=b'f' => Some(letter - b'a' + 10),
        _ => None,
    };
    for (byte, [high, low]) in bytes.iter_mut().zip(digits.as_bytes().as_chunks().0) {
        *byte = 16 * digit(*high)? + digit(*low)?;
    }
    Some(bytes)
}

impl fmt::Display for TypeHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Rihs01(bytes) => {
                f.write_str(PREFIX)?;
                bytes.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
            }
            Self::Unsupported => f.write_str(UNSUPPORTED),
        }
    }
}
