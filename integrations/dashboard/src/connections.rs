//! Bounds on connections: however many clients connect and say nothing, a next one is served.
//!
//! A connection that has not become a WebSocket is closed after [`IDLE`], and the oldest of them when there are more than [`MOST`].

use axum::extract::connect_info::Connected;
use axum::serve::{IncomingStream, Listener};
use std::collections::VecDeque;
use std::io;
use std::net::Shutdown;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll};
use std::time::{Duration, Instant};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};

/// Connections that may be open without being a WebSocket.
const MOST: usize = 64;

/// Time within which a connection must ask for something.
const IDLE: Duration = Duration::from_secs(10);

/// A listener that keeps a list of what it has accepted.
#[derive(Debug)]
pub(crate) struct Bounded {
    listener: TcpListener,
    open: Open,
    next: u64,
}

/// The connections that are not WebSockets, the oldest first. Clones share the list.
#[derive(Clone, Debug, Default)]
pub(crate) struct Open(Arc<Mutex<VecDeque<Entry>>>);

#[derive(Debug)]
struct Entry {
    number: u64,
    since: Instant,
    /// A second handle, to close it by.
    stream: std::net::TcpStream,
}

/// The number of a connection.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Connection(u64);

impl Bounded {
    pub(crate) fn new(listener: TcpListener, open: Open) -> Self {
        Self { listener, open, next: 0 }
    }
}

impl Open {
    /// The connection has become a WebSocket.
    pub(crate) fn release(&self, connection: Connection) {
        self.entries().retain(|entry| entry.number != connection.0);
    }

    /// Closes those that have been idle for too long.
    pub(crate) fn close_idle(&self) {
        let mut entries = self.entries();
        while entries.front().is_some_and(|entry| entry.since.elapsed() > IDLE) {
            close(entries.pop_front());
        }
    }

    fn add(&self, entry: Entry) {
        let mut entries = self.entries();
        entries.push_back(entry);
        while entries.len() > MOST {
            close(entries.pop_front());
        }
    }

    fn entries(&self) -> MutexGuard<'_, VecDeque<Entry>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn close(entry: Option<Entry>) {
    if let Some(entry) = entry {
        // It may be closed already.
        let _ = entry.stream.shutdown(Shutdown::Both);
    }
}

impl Listener for Bounded {
    type Io = Guarded;
    type Addr = Connection;

    async fn accept(&mut self) -> (Guarded, Connection) {
        loop {
            let accepted = match self.listener.accept().await {
                Ok((stream, _)) => twice(stream),
                Err(error) => Err(error),
            };
            match accepted {
                Ok((stream, second)) => {
                    self.next += 1;
                    let number = self.next;
                    self.open.add(Entry { number, since: Instant::now(), stream: second });
                    return (Guarded { stream, number, open: self.open.clone() }, Connection(number));
                }
                Err(error) => {
                    tracing::debug!(%error, "a connection was not accepted");
                    // For example, out of file handles: the next attempt would fail at once.
                    tokio::time::sleep(Duration::from_millis(10)).await;
                }
            }
        }
    }

    fn local_addr(&self) -> io::Result<Connection> {
        Ok(Connection(0))
    }
}

/// A stream, and a second handle of it.
fn twice(stream: TcpStream) -> io::Result<(TcpStream, std::net::TcpStream)> {
    stream.set_nodelay(true)?;
    let stream = stream.into_std()?;
    let second = stream.try_clone()?;
    Ok((TcpStream::from_std(stream)?, second))
}

impl Connected<IncomingStream<'_, Bounded>> for Connection {
    fn connect_info(stream: IncomingStream<'_, Bounded>) -> Self {
        *stream.remote_addr()
    }
}

/// An accepted stream, which leaves the list when it is dropped.
#[derive(Debug)]
pub(crate) struct Guarded {
    stream: TcpStream,
    number: u64,
    open: Open,
}

impl Drop for Guarded {
    fn drop(&mut self) {
        self.open.release(Connection(self.number));
    }
}

impl AsyncRead for Guarded {
    fn poll_read(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buffer: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(cx, buffer)
    }
}

impl AsyncWrite for Guarded {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.stream).poll_write(cx, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(cx)
    }
}
