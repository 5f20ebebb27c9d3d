//! Tokens, by which nodes and their publishers, subscriptions, services and clients are known, and the keys of what they send.

use crate::{NameError, Node, Qos, QosError, TypeError, TypeHash, TypeName};
use std::fmt;
use std::str::FromStr;
use thiserror::Error;
use twox_hash::XxHash3_128;

/// The beginning of every token.
const TOKENS: &str = "@ros2_lv";

/// The key that all tokens of a domain match.
pub fn tokens_of(domain: u32) -> String {
    format!("{TOKENS}/{domain}/**")
}

/// The id of a publisher, a subscription, a service or a client: the hash of its token.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Gid(pub [u8; Self::BYTES]);

impl Gid {
    /// Number of bytes.
    pub const BYTES: usize = 16;

    /// The id of what has this token.
    pub fn of(token: &str) -> Self {
        Self(XxHash3_128::oneshot(token.as_bytes()).to_le_bytes())
    }
}

impl fmt::Display for Gid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

/// A name with its type, as messages and requests are addressed.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Address {
    /// The full name: `/sensor/base/imu`.
    pub name: String,
    /// The name of the type.
    pub type_name: TypeName,
    /// The hash of the type.
    pub type_hash: TypeHash,
}

impl Address {
    /// The key of what is sent there.
    ///
    /// ```
    /// use bb_ros2::{Address, TypeHash};
    ///
    /// let type_name = "std_msgs/msg/String".parse()?;
    /// let address = Address { name: "/robot_description".into(), type_name, type_hash: TypeHash::Unsupported };
    /// assert_eq!(address.key(7), "7/robot_description/std_msgs::msg::dds_::String_/TypeHashNotSupported");
    /// assert_eq!(address.key_of_any_hash(7), "7/robot_description/std_msgs::msg::dds_::String_/*");
    /// # Ok::<(), bb_ros2::TypeError>(())
    /// ```
    pub fn key(&self, domain: u32) -> String {
        self.key_with(domain, &self.type_hash.to_string())
    }

    /// The key that matches whatever hash the other side has.
    pub fn key_of_any_hash(&self, domain: u32) -> String {
        self.key_with(domain, "*")
    }

    fn key_with(&self, domain: u32, hash: &str) -> String {
        format!("{domain}/{}/{}/{hash}", self.name.trim_matches('/'), self.type_name.in_dds())
    }
}

/// Kind of an endpoint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum EndpointKind {
    /// A publisher.
    Publisher,
    /// A subscription.
    Subscription,
    /// A service, which answers requests.
    Service,
    /// A client, which makes requests.
    Client,
}

const NODE: &str = "NN";

impl EndpointKind {
    /// All of them, with their names in tokens.
    const NAMES: [(Self, &str); 4] =
        [(Self::Publisher, "MP"), (Self::Subscription, "MS"), (Self::Service, "SS"), (Self::Client, "SC")];

    fn name(self) -> &'static str {
        Self::NAMES[self as usize].1
    }
}

/// A publisher, a subscription, a service or a client.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Endpoint {
    /// Kind.
    pub kind: EndpointKind,
    /// Name and type.
    pub address: Address,
    /// Quality of service.
    pub qos: Qos,
    /// The chunk that Lyrical and later append, of buffers in other memory.
    pub backends: Option<String>,
}

/// A node, or an endpoint of one. Its text is a key of zenoh, which the owner declares as a token:
///
/// ```
/// use bb_ros2::{Address, Endpoint, EndpointKind, Gid, Node, Qos, Token};
///
/// let address = Address {
///     name: "/sensor/base/imu".into(),
///     type_name: "sensor_msgs/msg/Imu".parse()?,
///     type_hash: "RIHS01_7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b".parse()?,
/// };
/// let token = Token {
///     domain: 0,
///     session: "efb06a3dfd2f2bf099770fc39fd8fff0".into(),
///     node_id: 0,
///     id: 10,
///     enclave: "/".into(),
///     node: Node::new("/", "rover")?,
///     endpoint: Some(Endpoint { kind: EndpointKind::Publisher, address, qos: Qos::reliable(7), backends: None }),
/// };
/// let text = "@ros2_lv/0/efb06a3dfd2f2bf099770fc39fd8fff0/0/10/MP/%/%/rover/%sensor%base%imu/sensor_msgs::msg::dds_::Imu_/\
///             RIHS01_7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b/::,7:,:,:,,";
/// assert_eq!(token.to_string(), text);
/// assert_eq!(text.parse(), Ok(token));
/// assert_eq!(Gid::of(text).to_string().len(), 32);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Token {
    /// `ROS_DOMAIN_ID`.
    pub domain: u32,
    /// The id of the session of zenoh.
    pub session: String,
    /// The number of the node in the session.
    pub node_id: u64,
    /// The number of this node or endpoint in the session.
    pub id: u64,
    /// The enclave of its rights: `/`.
    pub enclave: String,
    /// The node.
    pub node: Node,
    /// The endpoint; `None` for the node itself.
    pub endpoint: Option<Endpoint>,
}

impl fmt::Display for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { domain, session, node_id, id, enclave, node, endpoint } = self;
        let kind = endpoint.as_ref().map_or(NODE, |endpoint| endpoint.kind.name());
        let (enclave, namespace) = (without_slashes(enclave), without_slashes(node.namespace()));
        write!(f, "{TOKENS}/{domain}/{session}/{node_id}/{id}/{kind}/{enclave}/{namespace}/{}", node.name())?;
        let Some(Endpoint { address, qos, backends, .. }) = endpoint else { return Ok(()) };
        let Address { name, type_name, type_hash } = address;
        write!(f, "/{}/{}/{type_hash}/{qos}", without_slashes(name), type_name.in_dds())?;
        backends.iter().try_for_each(|backends| write!(f, "/{}", without_slashes(backends)))
    }
}

/// A text that is not a token.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum TokenError {
    /// Another form.
    #[error("`{token}` is no token: {fault}")]
    Form {
        /// The text.
        token: String,
        /// Fault.
        fault: &'static str,
    },
    /// A name in it is not one of ROS.
    #[error("in the token `{token}`: {error}")]
    Name {
        /// The text.
        token: String,
        /// Fault.
        error: NameError,
    },
    /// A type in it is not one of ROS.
    #[error("in the token `{token}`: {error}")]
    Type {
        /// The text.
        token: String,
        /// Fault.
        error: TypeError,
    },
    /// A quality of service that cannot be read.
    #[error("in the token `{token}`: {error}")]
    Qos {
        /// The text.
        token: String,
        /// Fault.
        error: QosError,
    },
}

impl FromStr for Token {
    type Err = TokenError;

    fn from_str(text: &str) -> Result<Self, TokenError> {
        let token = || text.to_owned();
        let form = |fault| TokenError::Form { token: token(), fault };
        let chunks: Vec<&str> = text.split('/').collect();
        if chunks.contains(&"") {
            return Err(form("a chunk of it is empty"));
        }
        let [start, domain, session, node_id, id, kind, enclave, namespace, node, endpoint @ ..] =
            chunks.as_slice()
        else {
            return Err(form("it has fewer than nine chunks"));
        };
        if *start != TOKENS {
            return Err(form("it does not begin with `@ros2_lv`"));
        }
        if !session.bytes().all(|letter| letter.is_ascii_hexdigit()) {
            return Err(form("the session is no hexadecimal number"));
        }
        let number = |text: &str| -> Result<u64, TokenError> {
            let digits = text.bytes().all(|letter| letter.is_ascii_digit()).then_some(text);
            digits
                .and_then(|digits| digits.parse().ok())
                .ok_or_else(|| form("one of its numbers is not a number, or too large"))
        };
        let name = |error| TokenError::Name { token: token(), error };
        let kinds = EndpointKind::NAMES.iter().find(|(_, name)| name == kind);
        let endpoint = match (kinds, endpoint) {
            (None, _) if *kind != NODE => return Err(form("it is of no known kind")),
            (None, _) => None,
            (Some((kind, _)), [address, type_name, type_hash, qos, more @ ..]) if more.len() < 2 => {
                let address = with_slashes(address);
                match kind {
                    EndpointKind::Publisher | EndpointKind::Subscription => crate::check_topic(&address),
                    EndpointKind::Service | EndpointKind::Client => crate::check_service(&address),
                }
                .map_err(name)?;
                let wrong_type = |error| TokenError::Type { token: token(), error };
                Some(Endpoint {
                    kind: *kind,
                    address: Address {
                        name: address,
                        type_name: TypeName::from_dds(type_name).map_err(wrong_type)?,
                        type_hash: type_hash.parse().map_err(wrong_type)?,
                    },
                    qos: qos.parse().map_err(|error| TokenError::Qos { token: token(), error })?,
                    backends: more.first().map(|backends| with_slashes(backends)),
                })
            }
            (Some(_), _) => return Err(form("an endpoint has 13 or 14 chunks")),
        };
        Ok(Self {
            domain: number(domain)?.try_into().map_err(|_| form("the domain is too large"))?,
            session: (*session).to_owned(),
            node_id: number(node_id)?,
            id: number(id)?,
            enclave: with_slashes(enclave),
            node: Node::new(&with_slashes(namespace), node).map_err(name)?,
            endpoint,
        })
    }
}

/// A chunk of a key has no slashes.
fn without_slashes(name: &str) -> String {
    name.replace('/', "%")
}

fn with_slashes(chunk: &str) -> String {
    chunk.replace('%', "/")
}
