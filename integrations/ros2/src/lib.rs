//! A robot as ROS 2 sees it, without any input or output: names, types, tokens and attachments are written and read here.
//!
//! | what | where |
//! |---|---|
//! | names of nodes, topics, services and parameters, from the robot's paths | [`Node`], [`parameter_name`] |
//! | names and hashes of types | [`TypeName`], [`TypeHash`] |
//! | what `rmw_zenoh_cpp` puts on the wire: keys, tokens with quality of service, ids and attachments | [`Address`], [`Token`], [`Qos`], [`Gid`], [`Attachment`] |
//! | `.msg` and `.srv` files of the types that ROS does not have | [`Interfaces`] |
//!
//! The form of tokens, keys and attachments is that of `rmw_zenoh_cpp` from Humble to Rolling.

// A robot must not stop because of what another program sends.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod attachment;
mod interfaces;
mod names;
mod qos;
mod token;
mod types;

pub use attachment::{ATTACHMENT_BYTES, Attachment, AttachmentError};
pub use interfaces::{InterfaceError, Interfaces, command_type};
pub use names::{NameError, Node, check_service, check_topic, parameter_name, parameter_path};
pub use qos::{Durability, History, Liveliness, Qos, QosError, Reliability};
pub use token::{Address, Endpoint, EndpointKind, Gid, Token, TokenError, tokens_of};
pub use types::{TypeError, TypeHash, TypeName};
