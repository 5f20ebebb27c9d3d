//! The state of a bridge that a robot declares.

use bb_core::Payload;
use std::time::Instant;

/// Clients and messages of a [`Foxglove`](crate::Foxglove) bridge, published when they have changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Payload)]
pub struct FoxgloveState {
    /// The port that it listens on.
    pub port: u16,
    /// Number of connected clients.
    pub clients: u32,
    /// Number of messages that have been encoded.
    pub encoded: u64,
    /// Number of messages that slow clients have lost, or that came faster than they could be encoded.
    pub lost: u64,
}

/// State of a bridge that a robot declares.
#[derive(Debug, Default)]
pub(crate) struct Bridged {
    pub(crate) reported: Option<FoxgloveState>,
    pub(crate) next: Option<Instant>,
    /// `true` if it has a rate, and so must not wait.
    pub(crate) is_paced: bool,
}
