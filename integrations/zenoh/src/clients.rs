//! The clients on the other side: each acts in a session of the robot that ends when its token is gone.

use crate::node::RosNode;
use crate::session::{SessionError, lock};
use bb_core::Bus;
use bb_core::component::Session;
use bb_ros2::{EndpointKind, Gid, Token, tokens_of};
use std::collections::HashMap;
use std::sync::{Arc, Mutex};
use zenoh::Wait;
use zenoh::pubsub::Subscriber;
use zenoh::sample::SampleKind;

/// Clients that are remembered, those that are gone included.
const MOST: usize = 4096;

/// The clients of services that other nodes have.
#[derive(Debug)]
pub(crate) struct Clients {
    bus: Bus,
    known: Arc<Mutex<HashMap<Gid, Client>>>,
    _tokens: Subscriber<()>,
}

#[derive(Debug)]
struct Client {
    session: Session,
    /// A request can come after the end of the token, as zenoh sends tokens first: it is refused, not taken for one of nobody.
    is_gone: bool,
}

impl Clients {
    /// Begins sessions of `bus`.
    ///
    /// # Errors
    /// The session of zenoh is closed.
    pub(crate) fn watch(bus: &Bus, node: &RosNode, domain: u32) -> Result<Self, SessionError> {
        let known = Arc::<Mutex<HashMap<Gid, Client>>>::default();
        let clients = Arc::clone(&known);
        let begin = bus.clone();
        let (own, zid) = (node.node().clone(), node.session().zid().to_string());
        let tokens = node.session().liveliness().declare_subscriber(tokens_of(domain)).history(true);
        let tokens = tokens.callback(move |sample| {
            let key = sample.key_expr().as_str();
            // Another program's token is not our fault: what cannot be read has no name.
            let Ok(token) = key.parse::<Token>() else { return };
            let Some(endpoint) = token.endpoint else {
                if sample.kind() == SampleKind::Put && token.node == own && token.session != zid {
                    let name = own.full_name();
                    tracing::warn!(name, "another node has this name: a request, as to arm, reaches both; give each a name of its own");
                }
                return;
            };
            if endpoint.kind != EndpointKind::Client {
                return;
            }
            let gid = Gid::of(key);
            let mut clients = lock(&clients);
            match sample.kind() {
                SampleKind::Delete => {
                    if let Some(client) = clients.get_mut(&gid) {
                        client.session.end();
                        client.is_gone = true;
                    }
                }
                SampleKind::Put => {
                    if clients.len() >= MOST {
                        clients.retain(|_, client| !client.is_gone);
                    }
                    // A token is also repeated.
                    if clients.get(&gid).is_none_or(|client| client.is_gone) {
                        let session = begin.session(format!("ros2 {}", token.node.full_name()), begin.rights());
                        clients.insert(gid, Client { session, is_gone: false });
                    }
                }
            }
        });
        let tokens = tokens.wait().map_err(SessionError::of("watching the tokens of other nodes"))?;
        Ok(Self { bus: bus.clone(), known, _tokens: tokens })
    }

    /// The bus that acts in the name of a client, `ros2 /operator`, while that is there; of one that no node has, `ros2`, without an end.
    pub(crate) fn bus(&self, client: Option<Gid>) -> Bus {
        let known = lock(&self.known);
        client.and_then(|client| known.get(&client)).map_or_else(|| self.bus.clone(), |client| client.session.bus())
    }
}
