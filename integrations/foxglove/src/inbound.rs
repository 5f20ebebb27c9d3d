//! The frames of a client on their way to its server, which reads a message of any length on the thread of all clients.

use std::io::{Error, ErrorKind, Result};
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, copy};
use tokio::sync::Notify;

/// Bytes of a client's message, at most: far more than a request needs.
const MOST_BYTES: u64 = 64 * 1024;

/// Carries the frames of a client to its server, until it ends. Each is a sign of life: `pulse`.
///
/// # Errors
/// The connection fails, or a message is longer than [`MOST_BYTES`].
pub(crate) async fn relay(
    mut client: impl AsyncRead + Unpin,
    mut server: impl AsyncWrite + Unpin,
    pulse: &Notify,
) -> Result<()> {
    let mut message = 0_u64;
    loop {
        // RFC 6455, 5.2: flags and opcode, length, longer length, mask.
        let mut head = [0; 14];
        client.read_exact(&mut head[..2]).await?;
        pulse.notify_one();
        let [flags, short] = [head[0], head[1]];
        let is_last = flags & 0x80 != 0;
        let is_control = flags & 0x08 != 0;
        let wide = match short & 0x7f {
            126 => 2,
            127 => 8,
            _ => 0,
        };
        let masked = if short & 0x80 != 0 { 4 } else { 0 };
        let rest = &mut head[2..2 + wide + masked];
        client.read_exact(rest).await?;
        let length = match wide {
            0 => u64::from(short & 0x7f),
            _ => rest[..wide].iter().fold(0, |length, byte| length << 8 | u64::from(*byte)),
        };
        let before = if is_control { 0 } else { message };
        if before.saturating_add(length) > MOST_BYTES {
            return Err(Error::new(ErrorKind::InvalidData, "its message is too long"));
        }
        if !is_control {
            message = if is_last { 0 } else { before + length };
        }
        server.write_all(&head[..2 + wide + masked]).await?;
        if copy(&mut (&mut client).take(length), &mut server).await? < length {
            return Err(ErrorKind::UnexpectedEof.into());
        }
    }
}
