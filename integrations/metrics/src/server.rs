//! The thread that answers requests.
//!
//! One request after the other, each with a second at most: a scrape comes every few seconds, and a misbehaving
//! client costs a second, not a thread.

use crate::request;
use std::fmt;
use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, TcpListener, TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// Why no server runs.
#[derive(Debug, thiserror::Error)]
#[error("cannot serve metrics at {address}: {source}")]
pub struct ServeError {
    address: String,
    source: io::Error,
}

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
        render: Box<dyn Fn() -> String + Send>,
    ) -> Result<Self, ServeError> {
        let named = address.to_string();
        let start = || {
            let listener = TcpListener::bind(address)?;
            let address = listener.local_addr()?;
            let is_stopping = Arc::new(AtomicBool::new(false));
            let told = Arc::clone(&is_stopping);
            let thread =
                thread::Builder::new().name("metrics".into()).spawn(move || answer(&listener, &told, &*render))?;
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

fn answer(listener: &TcpListener, is_stopping: &AtomicBool, render: &dyn Fn() -> String) {
    loop {
        let connection = listener.accept();
        if is_stopping.load(Ordering::Acquire) {
            return;
        }
        let served = connection.and_then(|(stream, _)| request::serve(stream, render));
        if let Err(error) = served {
            tracing::debug!(%error, "a scrape was not answered");
            // For example, out of file handles: the next attempt would fail at once.
            thread::sleep(Duration::from_millis(10));
        }
    }
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
