//! The handle for users, and the server's thread.

use crate::channels::{Channels, Watch};
use crate::door::{Door, hidden_addresses};
use crate::options::FoxgloveOptions;
use crate::parameters::{Parameters, changed};
use crate::services::services;
use crate::state::Bridged;
use bb_core::component::Session;
use bb_core::event::{ParameterChange, Right, Rights};
use bb_core::{Bus, DynamicSubscription, Overflow, Payload, Select};
use foxglove::websocket::Parameter;
use foxglove::{Context, FoxgloveError, WebSocketServer, WebSocketServerHandle};
use std::fmt;
use std::io;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;
use tokio::net::TcpListener;
use tokio::sync::{mpsc, watch};

/// Time between two looks for new paths.
const LOOK: Duration = Duration::from_secs(1);
/// Time that connections have to close at the end.
const LAST: Duration = Duration::from_millis(200);
/// Time after a connection that could not be taken.
const REST: Duration = Duration::from_millis(100);
/// Messages of a client that the server keeps until the door takes them.
const BACKLOG: usize = 16_384;
/// Changes of parameters that wait to be sent.
const CHANGES: usize = 1024;
/// Requests that wait for the robot, such as to disarm.
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

/// A bridge to Foxglove, served until it is dropped.
pub struct Foxglove {
    address: SocketAddr,
    channels: Arc<Channels>,
    door: Arc<Door>,
    clients: Arc<AtomicUsize>,
    /// Ends what was begun in the name of clients.
    session: Session,
    stop: watch::Sender<bool>,
    thread: Option<JoinHandle<()>>,
    pub(crate) bridged: Bridged,
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
        let bus = session.for_caller("foxglove", rights);
        let context = Context::new();
        let reader = session.for_caller("foxglove", [Right::Read]);
        let channels = Channels::new(reader.clone(), Arc::clone(&context)).map_err(ServeError::Server)?;
        let (news, values) = mpsc::unbounded_channel();
        let serve = |host: Ipv4Addr| {
            let mut server = WebSocketServer::new()
                .name(robot.description().robot)
                .context(&context)
                .bind(host.to_string(), 0)
                .message_backlog_size(BACKLOG)
                .listener(Arc::new(Watch(Arc::clone(&channels))))
                .services(services(&bus));
            if bus.rights().contains(Right::Parameters) {
                server = server.parameter_handler(Arc::new(Parameters { bus: bus.clone(), news: news.clone() }));
            }
            runtime.block_on(server.start()).map(|handle| (SocketAddr::from((host, handle.port())), handle))
        };
        let [hidden, plain] = hidden_addresses();
        let (behind, handle) = serve(hidden).or_else(|_| serve(plain)).map_err(ServeError::Server)?;
        let door = Arc::new(Door::new(origins, behind));
        let changes =
            reader.subscribe_any(Select::All, ParameterChange::NAME, Overflow::DropOldest { capacity: CHANGES });
        let clients = Arc::<AtomicUsize>::default();
        let (stop, stopped) = watch::channel(false);
        let serving = Serving {
            channels: Arc::clone(&channels),
            door: Arc::clone(&door),
            clients: Arc::clone(&clients),
            // Clients see no parameters if they have no right to set them.
            values: bus.rights().contains(Right::Parameters).then_some((values, changes)),
            handle,
        };
        let run = move || {
            runtime.block_on(serving.run(listener, stopped));
            // Calls of the robot that still wait end by themselves.
            runtime.shutdown_background();
        };
        let thread = thread::Builder::new().name("foxglove".into()).spawn(run).map_err(at)?;
        Ok(Self {
            address,
            channels,
            door,
            clients,
            session,
            stop,
            thread: Some(thread),
            bridged: Bridged::default(),
        })
    }

    /// The address it listens on.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Returns the number of connected clients.
    pub fn clients(&self) -> usize {
        self.clients.load(Ordering::Relaxed)
    }

    /// Returns the number of messages that have been encoded, for any number of clients each.
    pub fn encoded(&self) -> u64 {
        self.channels.counts().encoded.load(Ordering::Relaxed)
    }

    /// Returns the number of messages that slow clients have lost, those of each client added, and that came faster than they could be encoded.
    pub fn lost(&self) -> u64 {
        self.door.lost.load(Ordering::Relaxed) + self.channels.counts().unencoded.load(Ordering::Relaxed)
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

/// State of the server's thread.
struct Serving {
    channels: Arc<Channels>,
    door: Arc<Door>,
    clients: Arc<AtomicUsize>,
    /// Values that clients should know, and the changes of the robot.
    values: Option<(mpsc::UnboundedReceiver<Vec<Parameter>>, DynamicSubscription)>,
    handle: WebSocketServerHandle,
}

impl Serving {
    async fn run(mut self, listener: TcpListener, mut stopped: watch::Receiver<bool>) {
        let mut look = tokio::time::interval(LOOK);
        while !*stopped.borrow() {
            self.clients.store(self.handle.client_count(), Ordering::Relaxed);
            tokio::select! {
                _ = stopped.changed() => break,
                accepted = listener.accept() => match accepted {
                    Ok((client, _)) => _ = tokio::spawn(Arc::clone(&self.door).admit(client)),
                    // Such as too many open files.
                    Err(error) => {
                        tracing::warn!(%error, "a connection was not taken");
                        tokio::time::sleep(REST).await;
                    }
                },
                values = news(&mut self.values) => self.handle.publish_parameter_values(values),
                _ = look.tick() => if let Err(error) = self.channels.refresh() {
                    tracing::warn!(%error, "a path is no channel");
                },
            }
        }
        let closed = self.handle.stop();
        let _ = tokio::time::timeout(LAST, closed.wait()).await;
    }
}

/// The next values for all clients.
async fn news(
    values: &mut Option<(mpsc::UnboundedReceiver<Vec<Parameter>>, DynamicSubscription)>,
) -> Vec<Parameter> {
    let Some((values, changes)) = values else { return std::future::pending().await };
    loop {
        tokio::select! {
            Some(values) = values.recv() => return values,
            Some(change) = changes.recv_async() => if let Some(value) = changed(&change) {
                return vec![value];
            },
            else => return std::future::pending().await,
        }
    }
}
