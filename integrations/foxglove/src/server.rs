//! The bridge's handle, and the thread that serves it.

use crate::channels::Channels;
use crate::clients::Clients;
use crate::door::Door;
use crate::options::FoxgloveOptions;
use bb_core::component::{Session, StateReport};
use bb_core::event::{Right, Rights};
use bb_core::{Bus, Payload};
use foxglove::{Context, FoxgloveError};
use std::fmt;
use std::io;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;
use tokio::net::TcpListener;
use tokio::sync::watch;

/// Time between two searches for new paths.
const REFRESH_PERIOD: Duration = Duration::from_secs(1);
/// Pause after a connection could not be accepted.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);
/// Largest number of requests, other than to disarm, that wait for the robot.
const MOST_WAITING: usize = 64;

/// Reason for which no bridge runs.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ServeError {
    /// An option has an unusable value.
    #[error("the bridge to Foxglove is not served: {0}")]
    Options(bb_core::Fault),
    /// The address cannot be used.
    #[error("the bridge to Foxglove cannot be served at {address}: {source}")]
    Address {
        /// The address and port.
        address: SocketAddr,
        /// Error of the system.
        source: io::Error,
    },
    /// Foxglove's server has not started.
    #[error("Foxglove's server does not start: {0}")]
    Server(FoxgloveError),
}

/// Clients and messages of a [`Foxglove`] bridge, published when they have changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Payload)]
pub struct FoxgloveState {
    /// The port that it listens on.
    pub port: u16,
    /// Number of connected clients.
    pub clients: u32,
    /// Number of encoded messages, each counted once for all clients.
    pub encoded: u64,
    /// Number of messages that came faster than they could be encoded, or that slow clients have lost, summed over the clients.
    pub lost: u64,
}

/// A bridge to Foxglove, served until it is dropped.
pub struct Foxglove {
    address: SocketAddr,
    door: Arc<Door>,
    /// Session of all clients; ending it revokes their rights.
    session: Session,
    stop: watch::Sender<bool>,
    thread: Option<JoinHandle<()>>,
    pub(crate) report: StateReport<FoxgloveState>,
}

impl Foxglove {
    /// Serves a robot. A [`Running`](bb_core::Running) robot, a [`Simulation`](bb_core::Simulation) and their handles dereference to a [`Bus`];
    /// clients have at most its rights.
    ///
    /// # Errors
    /// An option has an unusable value, or the port is in use.
    pub fn serve(robot: &Bus, options: FoxgloveOptions) -> Result<Self, ServeError> {
        let rights = options.client_rights().map_err(ServeError::Options)?;
        let origins = options.page_origins().map_err(ServeError::Options)?;
        let asked = SocketAddr::from((Ipv4Addr::LOCALHOST, options.port));
        let at = |source| ServeError::Address { address: asked, source };
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_io()
            .enable_time()
            .max_blocking_threads(MOST_WAITING)
            .thread_name("foxglove request")
            .build()
            .map_err(at)?;
        let listener = runtime.block_on(TcpListener::bind(asked)).map_err(at)?;
        let address = listener.local_addr().map_err(at)?;
        let session = robot.session("foxglove", Rights::ALL);
        let reader = session.for_caller("foxglove", [Right::Read]);
        let channels = Channels::new(reader, Context::new()).map_err(ServeError::Server)?;
        let clients = Clients::new(session.for_caller("foxglove", rights), channels).map_err(at)?;
        let door = Arc::new(Door::new(origins, clients));
        let (stop, stopped) = watch::channel(false);
        let served = Arc::clone(&door);
        let run = move || {
            runtime.block_on(serve(listener, served, stopped));
            // Calls of the robot that still wait end on their own.
            runtime.shutdown_background();
        };
        let thread = thread::Builder::new().name("foxglove".into()).spawn(run).map_err(at)?;
        Ok(Self { address, door, session, stop, thread: Some(thread), report: StateReport::default() })
    }

    /// The address it listens on.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Clients and messages so far.
    pub fn state(&self) -> FoxgloveState {
        let Clients { channels, .. } = &self.door.clients;
        let count = |number: &AtomicU64| number.load(Ordering::Relaxed);
        FoxgloveState {
            port: self.address.port(),
            clients: u32::try_from(self.door.clients.count()).unwrap_or(u32::MAX),
            encoded: count(&channels.encoded),
            lost: count(&channels.lost),
        }
    }
}

impl Drop for Foxglove {
    fn drop(&mut self) {
        self.stop.send_replace(true);
        if let Some(thread) = self.thread.take() {
            // Its panic was printed.
            let _ = thread.join();
        }
        self.session.end();
    }
}

impl fmt::Debug for Foxglove {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Foxglove").field("address", &self.address).finish_non_exhaustive()
    }
}

async fn serve(listener: TcpListener, door: Arc<Door>, mut stopped: watch::Receiver<bool>) {
    let mut refresh = tokio::time::interval(REFRESH_PERIOD);
    while !*stopped.borrow() {
        tokio::select! {
            _ = stopped.changed() => break,
            accepted = listener.accept() => match accepted {
                Ok((client, _)) => _ = tokio::spawn(Arc::clone(&door).admit(client)),
                // For example, too many files are open.
                Err(error) => {
                    tracing::warn!(%error, "a connection was not taken");
                    tokio::time::sleep(ACCEPT_PAUSE).await;
                }
            },
            _ = refresh.tick() => if let Err(error) = door.clients.channels.refresh() {
                tracing::warn!(%error, "a path is no channel");
            },
        }
    }
}
