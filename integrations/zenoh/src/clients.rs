//! The nodes on the other side, by the ids of their clients.

use crate::node::RosNode;
use crate::session::SessionError;
use bb_ros2::{EndpointKind, Gid, Token, tokens_of};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use zenoh::Wait;
use zenoh::pubsub::Subscriber;
use zenoh::sample::SampleKind;

/// The names of the nodes that have clients of services, by the ids of these.
#[derive(Debug)]
pub(crate) struct Clients {
    names: Arc<Mutex<HashMap<Gid, String>>>,
    _tokens: Subscriber<()>,
}

impl Clients {
    /// # Errors
    /// The session is closed.
    pub(crate) fn watch(node: &RosNode, domain: u32) -> Result<Self, SessionError> {
        let names = Arc::<Mutex<HashMap<Gid, String>>>::default();
        let known = Arc::clone(&names);
        let tokens = node.session().liveliness().declare_subscriber(tokens_of(domain)).history(true);
        let tokens = tokens.callback(move |sample| {
            let key = sample.key_expr().as_str();
            // Another program's token is not our fault: what cannot be read has no name.
            let Ok(token) = key.parse::<Token>() else { return };
            if token.endpoint.is_none_or(|endpoint| endpoint.kind != EndpointKind::Client) {
                return;
            }
            let mut known = known.lock().unwrap_or_else(PoisonError::into_inner);
            match sample.kind() {
                SampleKind::Put => known.insert(Gid::of(key), token.node.full_name()),
                SampleKind::Delete => known.remove(&Gid::of(key)),
            };
        });
        let tokens = tokens.wait().map_err(SessionError::of("watching the tokens of other nodes"))?;
        Ok(Self { names, _tokens: tokens })
    }

    /// The name by which the robot knows the caller: `ros2 /operator`.
    pub(crate) fn caller(&self, client: Option<Gid>) -> String {
        let names = self.names.lock().unwrap_or_else(PoisonError::into_inner);
        let name = client.and_then(|client| names.get(&client));
        name.map_or_else(|| "ros2".to_owned(), |name| format!("ros2 {name}"))
    }
}
