//! A bad link on loopback: TCP with a delay each way, which can be cut, also in the middle of a message.

use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::thread;
use std::time::{Duration, Instant};

/// Delay each way, and how far it varies.
pub(crate) const DELAY_MS: u64 = 5;
pub(crate) const JITTER_MS: u64 = 3;

/// Time for which a link that is cut waits for a message to be cut in the middle.
const CUTTING: Duration = Duration::from_millis(50);

/// State of a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum LinkState {
    /// Passes on after the delay.
    Open,
    /// Radio out of range: nothing is passed on, and nothing is closed.
    Frozen,
    /// Connections are closed, and new ones refused: a cable pulled out of a switch that notices.
    Closed,
}

/// A relay to another port.
#[derive(Clone)]
pub(crate) struct Relay {
    state: Arc<AtomicU8>,
    streams: Arc<Mutex<Vec<TcpStream>>>,
    address: SocketAddr,
}

impl Relay {
    /// Listens on a port of its own, and passes on to `to`.
    pub(crate) fn start(to: SocketAddr) -> std::io::Result<Self> {
        let listener = TcpListener::bind("127.0.0.1:0")?;
        let address = listener.local_addr()?;
        let relay =
            Self { state: Arc::new(AtomicU8::new(LinkState::Open as u8)), streams: Arc::default(), address };
        let serving = relay.clone();
        thread::spawn(move || {
            for near in listener.incoming().flatten() {
                if serving.is(LinkState::Closed) {
                    continue;
                }
                let Ok(far) = TcpStream::connect(to) else { continue };
                if let Err(error) = serving.join(near, far) {
                    eprintln!("relay: {error}");
                }
            }
        });
        Ok(relay)
    }

    pub(crate) fn port(&self) -> u16 {
        self.address.port()
    }

    pub(crate) fn set(&self, state: LinkState) {
        self.state.store(state as u8, Ordering::SeqCst);
        if state == LinkState::Closed {
            thread::sleep(CUTTING);
            for stream in self.streams.lock().unwrap_or_else(PoisonError::into_inner).drain(..) {
                let _ = stream.shutdown(Shutdown::Both);
            }
        }
    }

    fn is(&self, state: LinkState) -> bool {
        self.state.load(Ordering::SeqCst) == state as u8
    }

    fn join(&self, near: TcpStream, far: TcpStream) -> std::io::Result<()> {
        for stream in [&near, &far] {
            stream.set_nodelay(true)?;
            self.streams.lock().unwrap_or_else(PoisonError::into_inner).push(stream.try_clone()?);
        }
        self.pump(near.try_clone()?, far.try_clone()?, 1);
        self.pump(far, near, 2);
        Ok(())
    }

    /// Passes on one way: one thread reads, another writes what is due.
    fn pump(&self, mut from: TcpStream, mut to: TcpStream, seed: u64) {
        let (sender, receiver) = mpsc::sync_channel::<(Instant, Vec<u8>)>(4096);
        let relay = self.clone();
        thread::spawn(move || {
            let (mut buffer, mut random, mut last) = (vec![0; 65_536], seed, Instant::now());
            while let Ok(read @ 1..) = from.read(&mut buffer) {
                while relay.is(LinkState::Frozen) {
                    thread::sleep(Duration::from_millis(5));
                }
                random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                let jitter = (random >> 33) % (2 * JITTER_MS * 1000 + 1);
                let delay = Duration::from_micros((DELAY_MS - JITTER_MS) * 1000 + jitter);
                // TCP keeps the order.
                last = last.max(Instant::now() + delay);
                if sender.send((last, buffer[..read].to_vec())).is_err() {
                    break;
                }
            }
        });
        let relay = self.clone();
        thread::spawn(move || {
            for (due, bytes) in receiver {
                thread::sleep(due.saturating_duration_since(Instant::now()));
                let mut rest = bytes.as_slice();
                if !relay.is(LinkState::Open) {
                    // A link that is cut does not wait for the end of a message.
                    let (half, other) = rest.split_at(rest.len() / 2);
                    rest = other;
                    if to.write_all(half).is_err() {
                        break;
                    }
                }
                while relay.is(LinkState::Frozen) {
                    thread::sleep(Duration::from_millis(5));
                }
                if relay.is(LinkState::Closed) || to.write_all(rest).is_err() {
                    break;
                }
            }
            let _ = to.shutdown(Shutdown::Both);
        });
    }
}
