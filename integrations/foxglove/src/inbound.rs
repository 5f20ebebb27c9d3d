//! The frames of a client on their way to its server, which reads a message of any length on the thread of all clients.

use std::io::{Error, ErrorKind, Result};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, copy};
use tokio::sync::Notify;
use tokio::time::timeout;

/// Bytes of a client's message, at most: far more than a request needs.
const MOST_BYTES: u64 = 64 * 1024;

/// Calls under way that the server lets through: it refuses one more, also if that is to disarm.
const MOST_CALLS: usize = 32;
/// Calls that may be under way for long; others are refused at once.
const SLOW_CALLS: usize = crate::services::MOST_CALLS;
/// Time in which a call beyond those is answered; after it, what was taken for one was none.
const PATIENCE: Duration = Duration::from_millis(100);
/// First byte of a call.
const CALL: u8 = 2;

/// The calls of a client that its server has not answered.
#[derive(Debug, Default)]
pub(crate) struct Calls {
    under_way: AtomicUsize,
    has_ended: Notify,
}

impl Calls {
    /// Begins one, once the server has a place for it.
    async fn begin(&self) {
        while self.under_way.load(Ordering::Relaxed) >= MOST_CALLS {
            if timeout(PATIENCE, self.has_ended.notified()).await.is_err() {
                self.under_way.store(SLOW_CALLS, Ordering::Relaxed);
            }
        }
        self.under_way.fetch_add(1, Ordering::Relaxed);
    }

    /// Ends one, which was answered.
    pub(crate) fn end(&self) {
        let before = self.under_way.load(Ordering::Relaxed);
        self.under_way.store(before.saturating_sub(1), Ordering::Relaxed);
        self.has_ended.notify_one();
    }
}

/// Carries the frames of a client to its server, until it ends. Each is a sign of life: `pulse`.
///
/// # Errors
/// The connection fails, or a message is longer than [`MOST_BYTES`].
pub(crate) async fn relay(
    mut client: impl AsyncRead + Unpin,
    mut server: impl AsyncWrite + Unpin,
    pulse: &Notify,
    calls: &Calls,
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
        let mut first = [0_u8; 1];
        let first = &mut first[..usize::from(length > 0)];
        client.read_exact(first).await?;
        // RFC 6455, 5.3: the mask is the end of the head.
        let mask = if head[1] & 0x80 != 0 { head[head.len() - 4] } else { 0 };
        if head[0] & 0x0f == 2 && first.first().is_some_and(|byte| byte ^ mask == CALL) {
            calls.begin().await;
        }
        server.write_all(&[&head, &*first].concat()).await?;
        let rest = length - first.len() as u64;
        if copy(&mut (&mut client).take(rest), &mut server).await? < rest {
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
