//! A socket or a serial port, split into a reading end for the link's thread and a writing end for all users.

use crate::Address;
use std::io;
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, ToSocketAddrs, UdpSocket};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// The longest wait of a read: a dropped link stops within this time.
pub(crate) const READ_TIMEOUT: Duration = Duration::from_millis(50);

/// Time that a write to a serial port may take.
#[cfg(feature = "serial")]
const WRITE_TIMEOUT: Duration = Duration::from_millis(250);

/// The largest datagram.
pub(crate) const LONGEST_READ: usize = 65_536;

#[derive(Debug)]
pub(crate) enum Reader {
    Udp {
        socket: UdpSocket,
        /// Sender of the last datagram.
        from: Option<SocketAddr>,
        /// Destination of answers, if that is the sender.
        peer: Option<Arc<Mutex<Option<SocketAddr>>>>,
    },
    #[cfg(feature = "serial")]
    Serial(Box<dyn serialport::SerialPort>),
}

#[derive(Debug)]
pub(crate) enum Writer {
    Udp(UdpSocket, Peer),
    #[cfg(feature = "serial")]
    Serial(Box<dyn serialport::SerialPort>),
}

#[derive(Debug)]
pub(crate) enum Peer {
    /// The socket is connected.
    Known,
    /// The sender of the newest frame of a peer.
    Newest(Arc<Mutex<Option<SocketAddr>>>),
}

pub(crate) fn open(address: &Address) -> io::Result<(Reader, Writer)> {
    match address {
        Address::UdpIn { local } => {
            let socket = UdpSocket::bind(local.as_str())?;
            let peer = Arc::new(Mutex::new(None));
            udp(socket, Some(Arc::clone(&peer)), Peer::Newest(peer))
        }
        Address::UdpOut { remote } => {
            let remote =
                remote.to_socket_addrs()?.next().ok_or_else(|| io::Error::other("the host has no address"))?;
            let any: SocketAddr = match remote {
                SocketAddr::V4(_) => (Ipv4Addr::UNSPECIFIED, 0).into(),
                SocketAddr::V6(_) => (Ipv6Addr::UNSPECIFIED, 0).into(),
            };
            let socket = UdpSocket::bind(any)?;
            socket.connect(remote)?;
            udp(socket, None, Peer::Known)
        }
        #[cfg(feature = "serial")]
        Address::Serial { port, baud } => {
            let reader = serialport::new(port, *baud).timeout(READ_TIMEOUT).open()?;
            let mut writer = reader.try_clone()?;
            writer.set_timeout(WRITE_TIMEOUT)?;
            Ok((Reader::Serial(reader), Writer::Serial(writer)))
        }
        #[cfg(not(feature = "serial"))]
        Address::Serial { .. } => {
            Err(io::Error::other("serial ports need the feature `serial` of the crate `bb-mavlink`"))
        }
    }
}

fn udp(socket: UdpSocket, peer: Option<Arc<Mutex<Option<SocketAddr>>>>, to: Peer) -> io::Result<(Reader, Writer)> {
    socket.set_read_timeout(Some(READ_TIMEOUT))?;
    let writer = Writer::Udp(socket.try_clone()?, to);
    Ok((Reader::Udp { socket, from: None, peer }, writer))
}

impl Reader {
    /// Waits for bytes; returns 0 on a timeout. For UDP, it reads one datagram.
    pub(crate) fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = match self {
            Self::Udp { socket, from, .. } => socket.recv_from(buffer).map(|(length, address)| {
                *from = Some(address);
                length
            }),
            #[cfg(feature = "serial")]
            Self::Serial(port) => match port.read(buffer) {
                Ok(0) => return Err(io::Error::other("the port was closed")),
                read => read,
            },
        };
        match read {
            Err(error) if is_passing(&error) => Ok(0),
            read => read,
        }
    }

    pub(crate) fn is_datagrams(&self) -> bool {
        matches!(self, Self::Udp { .. })
    }

    /// The last bytes read contained a frame of a peer: its sender will be answered.
    pub(crate) fn accept_peer(&self) {
        if let Self::Udp { from: Some(from), peer: Some(peer), .. } = self {
            *peer.lock().unwrap_or_else(PoisonError::into_inner) = Some(*from);
        }
    }
}

/// A timeout; or, for a connected socket, a peer that does not listen yet.
fn is_passing(error: &io::Error) -> bool {
    use io::ErrorKind::{ConnectionRefused, ConnectionReset, Interrupted, TimedOut, WouldBlock};
    matches!(error.kind(), WouldBlock | TimedOut | Interrupted | ConnectionRefused | ConnectionReset)
}

impl Writer {
    /// Writes a frame. Returns `false` if no receiver is known.
    pub(crate) fn write(&mut self, frame: &[u8]) -> io::Result<bool> {
        let written = match self {
            Self::Udp(socket, Peer::Known) => socket.send(frame).map(|_| true),
            Self::Udp(socket, Peer::Newest(peer)) => {
                let peer = *peer.lock().unwrap_or_else(PoisonError::into_inner);
                let Some(peer) = peer else { return Ok(false) };
                socket.send_to(frame, peer).map(|_| true)
            }
            #[cfg(feature = "serial")]
            Self::Serial(port) => port.write_all(frame).map(|()| true),
        };
        match written {
            Err(error) if is_passing(&error) => Ok(false),
            written => written,
        }
    }
}
