//! The clients: each has a server of Foxglove's for itself, and a session of the robot that ends when it leaves.

use crate::channels::{Channels, Watch};
use crate::inbound;
use crate::outbox::Outbox;
use crate::parameters::{Parameters, changed};
use crate::services::{Disarms, disarms, services};
use bb_core::event::{ParameterChange, Right};
use bb_core::{Bus, Overflow, Payload, Select};
use foxglove::{FoxgloveError, WebSocketServer, WebSocketServerHandle};
use std::future::pending;
use std::io::{self, Error, ErrorKind};
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use tokio::io::AsyncWriteExt;
use tokio::net::TcpStream;
use tokio::sync::Notify;
use tokio::time::timeout;

/// Time after which a client that shows no sign of life has left; it is pinged each second.
const SILENCE: Duration = Duration::from_secs(3);
/// Time that a server has to end.
const LAST: Duration = Duration::from_millis(200);
/// Messages that a server keeps until the outbox takes them.
const BACKLOG: usize = 16_384;
/// Changes of parameters that wait to be sent.
const CHANGES: usize = 1024;

/// The clients.
pub(crate) struct Clients {
    /// Has the rights of each.
    bus: Bus,
    pub(crate) channels: Arc<Channels>,
    disarms: Arc<Disarms>,
    /// The id that makes one server of them, for a client that connects again.
    session: String,
    begun: AtomicU64,
    /// Held by each.
    open: Arc<()>,
}

impl Clients {
    /// # Errors
    /// The system has no thread.
    pub(crate) fn new(bus: Bus, channels: Arc<Channels>) -> io::Result<Self> {
        let session = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos()).to_string();
        Ok(Self { bus, channels, disarms: disarms()?, session, begun: AtomicU64::new(0), open: Arc::default() })
    }

    pub(crate) fn count(&self) -> usize {
        Arc::strong_count(&self.open) - 1
    }

    /// Serves a client, whose request begins with `head`, until one of both sides ends.
    pub(crate) async fn serve(&self, client: TcpStream, head: &[u8]) -> io::Result<()> {
        let _open = Arc::clone(&self.open);
        let name = format!("foxglove {}", self.begun.fetch_add(1, Ordering::Relaxed) + 1);
        let session = self.bus.session(name, self.bus.rights());
        let [hidden, plain] = hidden_addresses();
        let (address, handle) = match self.start(&session, hidden).await {
            Ok(started) => started,
            Err(_) => self.start(&session, plain).await.map_err(Error::other)?,
        };
        let carried = async {
            let mut server = TcpStream::connect(address).await?;
            server.set_nodelay(true)?;
            server.write_all(head).await?;
            let (from_client, to_client) = client.into_split();
            let (from_server, to_server) = server.into_split();
            let outbox = Outbox::new(&self.channels.lost);
            let pulse = Notify::new();
            tokio::select! {
                ended = inbound::relay(from_client, to_server, &pulse, &outbox.calls) => ended,
                ended = outbox.relay(from_server, to_client, &pulse) => ended,
                () = until_silent(&pulse) => Err(Error::new(ErrorKind::TimedOut, "it does not answer")),
            }
        };
        let ended = tokio::select! {
            ended = carried => ended,
            () = tell_changes(&session, &handle) => Ok(()),
        };
        session.end();
        let _ = timeout(LAST, handle.stop().wait()).await;
        ended
    }

    async fn start(&self, bus: &Bus, host: Ipv4Addr) -> Result<(SocketAddr, WebSocketServerHandle), FoxgloveError> {
        let mut server = WebSocketServer::new()
            .name(bus.description().robot)
            .session_id(&self.session)
            .context(&self.channels.context)
            .bind(host.to_string(), 0)
            .message_backlog_size(BACKLOG)
            .listener(Arc::new(Watch(Arc::clone(&self.channels))))
            .services(services(bus, &self.disarms));
        if bus.rights().contains(Right::Parameters) {
            server = server.parameter_handler(Arc::new(Parameters(bus.clone())));
        }
        let handle = server.start().await?;
        Ok((SocketAddr::from((host, handle.port())), handle))
    }
}

/// Waits until a client has shown no sign of life for [`SILENCE`]: it is frozen, or its cable is cut.
async fn until_silent(pulse: &Notify) {
    while timeout(SILENCE, pulse.notified()).await.is_ok() {}
}

/// Sends the changes of parameters to a client, for ever; it sees none if it has no right to set them.
async fn tell_changes(bus: &Bus, server: &WebSocketServerHandle) {
    if bus.rights().contains(Right::Parameters) {
        let overflow = Overflow::DropOldest { capacity: CHANGES };
        let mut changes = bus.subscribe_any(Select::All, ParameterChange::NAME, overflow);
        while let Some(change) = changes.recv_async().await {
            server.publish_parameter_values(changed(&change).into_iter().collect());
        }
    }
    pending().await
}

/// Addresses to put a server at, the best first. All of 127.0.0.0/8 is this machine, but not by every system: at one of 16 million addresses, and at a
/// port that the system chooses, no page finds it by trying.
fn hidden_addresses() -> [Ipv4Addr; 2] {
    use std::hash::{BuildHasher, RandomState};
    // Its keys are random numbers of the system's.
    let [a, b, c, ..] = RandomState::new().hash_one(0_u8).to_ne_bytes();
    [Ipv4Addr::new(127, a, b, c.clamp(1, 254)), Ipv4Addr::LOCALHOST]
}
