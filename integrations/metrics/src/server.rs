//! The threads that answer requests.
//!
//! Each connection has a thread for two seconds at most. When [`MOST`] are open, a further one closes the oldest: clients that
//! send nothing delay no other client, and cost no more than these threads.

use crate::request;
use std::collections::VecDeque;
use std::fmt;
use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, Shutdown, SocketAddr, TcpListener, TcpStream, ToSocketAddrs};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// Reason for which no server runs.
#[derive(Debug, thiserror::Error)]
#[error("cannot serve metrics at {address}: {source}")]
pub struct ServeError {
    address: String,
    source: io::Error,
}

/// Connections that may be open.
const MOST: usize = 16;

/// The counts as text.
type Render = dyn Fn() -> String + Send;

/// Answers scrapes until it is dropped.
#[derive(Debug)]
pub struct Server {
    address: SocketAddr,
    is_stopping: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Server {
    /// The address it listens on.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    pub(crate) fn start(
        address: impl ToSocketAddrs + fmt::Display,
        render: Box<Render>,
    ) -> Result<Self, ServeError> {
        let named = address.to_string();
        let start = || {
            let listener = TcpListener::bind(address)?;
            let address = listener.local_addr()?;
            let is_stopping = Arc::new(AtomicBool::new(false));
            let told = Arc::clone(&is_stopping);
            let render = Arc::new(Mutex::new(render));
            let accept = move || accept(&listener, &told, &render);
            let thread = thread::Builder::new().name("metrics".into()).spawn(accept)?;
            Ok(Self { address, is_stopping, thread: Some(thread) })
        };
        start().map_err(|source| ServeError { address: named, source })
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.is_stopping.store(true, Ordering::Release);
        // The thread waits for a connection, so it gets one. If none can be made, it ends at the next incoming one.
        let woken = TcpStream::connect_timeout(&reachable(self.address), Duration::from_secs(1)).is_ok();
        if let Some(thread) = self.thread.take()
            && woken
        {
            let _ = thread.join();
        }
    }
}

/// A connection that is being answered.
struct Open {
    stream: TcpStream,
    thread: JoinHandle<()>,
}

fn accept(listener: &TcpListener, is_stopping: &AtomicBool, render: &Arc<Mutex<Box<Render>>>) {
    let mut open = VecDeque::new();
    loop {
        let connection = listener.accept();
        if is_stopping.load(Ordering::Acquire) {
            break;
        }
        open.retain(|open: &Open| !open.thread.is_finished());
        if open.len() >= MOST
            && let Some(oldest) = open.pop_front()
        {
            close(oldest);
        }
        match connection.and_then(|(stream, _)| answer(stream, render)) {
            Ok(answered) => open.push_back(answered),
            Err(error) => {
                tracing::debug!(%error, "a scrape was not answered");
                // For example, out of file handles: the next attempt would fail at once.
                thread::sleep(Duration::from_millis(10));
            }
        }
    }
    open.into_iter().for_each(close);
}

fn answer(stream: TcpStream, render: &Arc<Mutex<Box<Render>>>) -> io::Result<Open> {
    let (served, render) = (stream.try_clone()?, Arc::clone(render));
    let serve = move || {
        let render = || render.lock().unwrap_or_else(PoisonError::into_inner)();
        if let Err(error) = request::serve(served, &render) {
            tracing::debug!(%error, "a scrape was not answered");
        }
    };
    let thread = thread::Builder::new().name("metrics request".into()).spawn(serve)?;
    Ok(Open { stream, thread })
}

/// Ends what its thread waits for, and the thread with it.
fn close(open: Open) {
    // It may be closed already.
    let _ = open.stream.shutdown(Shutdown::Both);
    // Its panic was that of a collector, and printed.
    let _ = open.thread.join();
}

/// An address at which a listener of `address` can be reached from this machine.
fn reachable(address: SocketAddr) -> SocketAddr {
    let ip = match address.ip() {
        IpAddr::V4(ip) if ip.is_unspecified() => Ipv4Addr::LOCALHOST.into(),
        IpAddr::V6(ip) if ip.is_unspecified() => Ipv6Addr::LOCALHOST.into(),
        ip => ip,
    };
    SocketAddr::new(ip, address.port())
}
