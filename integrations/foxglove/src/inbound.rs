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
        let (head, length) = head(&mut client).await?;
        pulse.notify_one();
        let is_last = head[0] & 0x80 != 0;
        let is_control = head[0] & 0x08 != 0;
        let before = if is_control { 0 } else { message };
        if before.saturating_add(length) > MOST_BYTES {
            return Err(Error::new(ErrorKind::InvalidData, "its message is too long"));
        }
        if !is_control {
            message = if is_last { 0 } else { before + length };
        }
        server.write_all(&head).await?;
        if copy(&mut (&mut client).take(length), &mut server).await? < length {
            return Err(ErrorKind::UnexpectedEof.into());
        }
    }
}

/// The head of a frame, and the number of bytes after it.
pub(crate) async fn head(from: &mut (impl AsyncRead + Unpin)) -> Result<(Vec<u8>, u64)> {
    // RFC 6455, 5.2: flags and opcode, length, longer length, mask.
    let mut head = vec![0; 2];
    from.read_exact(&mut head).await?;
    let short = head[1] & 0x7f;
    let wide = match short {
        126 => 2,
        127 => 8,
        _ => 0,
    };
    let masked = if head[1] & 0x80 != 0 { 4 } else { 0 };
    head.resize(2 + wide + masked, 0);
    from.read_exact(&mut head[2..]).await?;
    let length = match wide {
        0 => u64::from(short),
        _ => head[2..2 + wide].iter().fold(0, |length, byte| length << 8 | u64::from(*byte)),
    };
    Ok((head, length))
}
