//! The handle for users, and the server's thread.

use crate::connections::{Bounded, Connection, Open};
use crate::gate::Gate;
use crate::guests::Guests;
use crate::hub::Hub;
use crate::meshes::Meshes;
use crate::options::DashboardOptions;
use crate::page;
use crate::protocol::LONGEST;
use crate::shared::Shared;
use crate::token::Token;
use crate::viewer;
use axum::Router;
use axum::extract::connect_info::ConnectInfo;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{Path, Request, State};
use axum::http::header::{AUTHORIZATION, CONTENT_TYPE};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use bb_core::component::StateReport;
use bb_core::{Bus, Payload};
use std::fmt;
use std::io;
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::Duration;
use tokio::sync::watch;

/// Threads that wait for what a viewer has asked for, such as to disarm.
const MOST_WAITING: usize = 128;

/// Reason for which no dashboard runs.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ServeError {
    /// An option has an unusable value.
    #[error("the dashboard is not served: {0}")]
    Options(bb_core::Fault),
    /// The address cannot be used.
    #[error("the dashboard cannot be served at {address}: {source}")]
    Address {
        /// The address and port.
        address: SocketAddr,
        /// Error of the system.
        source: io::Error,
    },
    /// The system gives no random numbers for the token.
    #[error("no token for the dashboard: {0}")]
    Token(getrandom::Error),
}

/// The viewers of a [`Dashboard`], published when their number has changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Payload)]
pub struct DashboardState {
    /// The port that it listens on.
    pub port: u16,
    /// Number of connected viewers.
    pub viewers: u32,
}

/// A dashboard, served until it is dropped.
pub struct Dashboard {
    address: SocketAddr,
    token: Token,
    shared: Arc<Shared>,
    stop: watch::Sender<bool>,
    thread: Option<JoinHandle<()>>,
    pub(crate) report: StateReport<DashboardState>,
}

impl Dashboard {
    /// Serves one robot. A [`Running`](bb_core::Running) robot, a [`Simulation`](bb_core::Simulation) and their handles dereference to a
    /// [`Bus`]; viewers have at most its rights.
    ///
    /// # Errors
    /// An option has an unusable value, or the address is in use.
    pub fn serve(robot: &Bus, options: DashboardOptions) -> Result<Self, ServeError> {
        Self::serve_all(&[robot], options)
    }

    /// Serves several robots of this process on one page.
    ///
    /// # Errors
    /// As [`Self::serve`].
    pub fn serve_all(robots: &[&Bus], options: DashboardOptions) -> Result<Self, ServeError> {
        let settings = options.settings().map_err(ServeError::Options)?;
        let meshes = Meshes::read(&options.meshes, robots).map_err(ServeError::Options)?;
        let asked = settings.address;
        let at = |source| ServeError::Address { address: asked, source };
        let listener = TcpListener::bind(asked).map_err(at)?;
        listener.set_nonblocking(true).map_err(at)?;
        let address = listener.local_addr().map_err(at)?;
        let token = Token::generate().map_err(ServeError::Token)?;
        let mut hubs: Vec<Hub> = Vec::new();
        for bus in robots {
            let name = bus.description().robot;
            let same = hubs.iter().filter(|hub| hub.bus.description().robot == name).count();
            let name = if same == 0 { name.to_owned() } else { format!("{name} {}", same + 1) };
            hubs.push(Hub::start(name, bus).map_err(at)?);
        }
        let open = Open::default();
        let gate = Gate::new(address.port(), &settings.hosts);
        let guests = Guests::default();
        let shared =
            Arc::new(Shared { hubs, meshes, settings, token: token.clone(), guests, gate, open: open.clone() });
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_io()
            .enable_time()
            .max_blocking_threads(MOST_WAITING)
            .thread_name("dashboard request")
            .build()
            .map_err(at)?;
        let (stop, stopped) = watch::channel(false);
        let served = Arc::clone(&shared);
        let run = move || {
            runtime.block_on(serve(listener, served, open, stopped));
            // Calls of the robot that still wait end by themselves.
            runtime.shutdown_background();
        };
        let thread = thread::Builder::new().name("dashboard".into()).spawn(run).map_err(at)?;
        Ok(Self { address, token, shared, stop, thread: Some(thread), report: StateReport::default() })
    }

    /// The address it listens on.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The address for browsers, without the token: everyone who opens it may read.
    pub fn reading_url(&self) -> String {
        format!("http://{}/", self.address)
    }

    /// The address for browsers, with the token in its fragment, which browsers do not send, log or pass on: everyone who opens it has the
    /// [rights](DashboardOptions::rights).
    pub fn url(&self) -> String {
        format!("{}#token={}", self.reading_url(), self.token.text())
    }

    /// Returns the number of connected viewers.
    pub fn viewers(&self) -> usize {
        self.shared.guests.count()
    }
}

impl Drop for Dashboard {
    fn drop(&mut self) {
        self.stop.send_replace(true);
        if let Some(thread) = self.thread.take() {
            // Its panic was printed.
            let _ = thread.join();
        }
    }
}

impl fmt::Debug for Dashboard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Dashboard").field("address", &self.address).finish_non_exhaustive()
    }
}

async fn serve(listener: TcpListener, shared: Arc<Shared>, open: Open, mut stopped: watch::Receiver<bool>) {
    let listener = match tokio::net::TcpListener::from_std(listener) {
        Ok(listener) => Bounded::new(listener, open.clone()),
        Err(error) => {
            tracing::error!(%error, "the dashboard is not served");
            return;
        }
    };
    let mut router = Router::new().route("/ws", get(upgrade)).route("/mesh/{number}", get(mesh));
    for (path, kind, contents) in page::FILES {
        router = router.route(path, get(move || async move { page::file(kind, contents) }));
    }
    let router = router
        .fallback(|| async { (StatusCode::NOT_FOUND, "there is no such page\n") })
        .layer(from_fn_with_state(Arc::clone(&shared), guard))
        .with_state(shared);
    let served = axum::serve(listener, router.into_make_service_with_connect_info::<Connection>());
    let tidy = async {
        loop {
            tokio::time::sleep(Duration::from_secs(1)).await;
            open.close_idle();
        }
    };
    tokio::select! {
        _ = served => {}
        () = tidy => {}
        _ = stopped.wait_for(|is_stopped| *is_stopped) => {}
    }
}

/// Checks each request, and adds the headers to each answer.
async fn guard(State(shared): State<Arc<Shared>>, request: Request, next: Next) -> Response {
    let mut response = match shared.gate.check(request.headers()) {
        Ok(()) => next.run(request).await,
        Err(refusal) => {
            tracing::warn!(headers = ?request.headers(), "a request to the dashboard was refused");
            refusal.into_response()
        }
    };
    for (name, value) in page::HEADERS {
        response.headers_mut().insert(HeaderName::from_static(name), HeaderValue::from_static(value));
    }
    response
}

/// The file of a mesh: for all who may read.
async fn mesh(State(shared): State<Arc<Shared>>, Path(number): Path<usize>, headers: HeaderMap) -> Response {
    let given = headers.get(AUTHORIZATION).and_then(|given| given.to_str().ok()?.strip_prefix("Bearer "));
    if shared.settings.reads_need_token && !given.is_some_and(|given| shared.token.is(given)) {
        return (StatusCode::UNAUTHORIZED, "to read needs the token\n").into_response();
    }
    match shared.meshes.get(number) {
        Some(bytes) => ([(CONTENT_TYPE, "model/stl")], bytes).into_response(),
        None => (StatusCode::NOT_FOUND, "there is no such mesh\n").into_response(),
    }
}

async fn upgrade(
    State(shared): State<Arc<Shared>>,
    ConnectInfo(connection): ConnectInfo<Connection>,
    upgrade: WebSocketUpgrade,
) -> Response {
    let Some(seat) = shared.guests.seat() else {
        return (StatusCode::SERVICE_UNAVAILABLE, "too many viewers are connected\n").into_response();
    };
    let upgrade = upgrade.max_message_size(LONGEST).max_frame_size(LONGEST);
    upgrade.on_upgrade(move |socket| async move {
        shared.open.release(connection);
        viewer::serve(socket, &shared, seat).await;
    })
}
