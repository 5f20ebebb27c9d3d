//! The queue of one client. The server's own queue drops messages without saying so; it is read without delay, so that messages wait, and
//! are counted, here.

use crate::inbound::{Calls, head};
use std::collections::VecDeque;
use std::io::{Error, ErrorKind, Result};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::io::{AsyncBufReadExt, AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, BufReader};
use tokio::sync::Notify;
use tokio::time::timeout;

/// Messages that wait for a client, at most.
const MOST_MESSAGES: usize = 1024;
/// Bytes of these messages, at most, unless one message alone is longer.
const MOST_BYTES: usize = 16 * 1024 * 1024;
/// Frames that are no messages of topics and wait, at most, with no more than [`MOST_BYTES`]: they are never dropped, and with more the client is
/// disconnected.
const MOST_OTHERS: usize = 4096;
/// Time between two warnings.
const WARNING: Duration = Duration::from_secs(1);
/// Time between two questions whether the client is there.
const PING: Duration = Duration::from_secs(1);
/// Time that a write takes if it waits for the client to read, which is a sign of life: what the system holds may delay the answer to a ping.
const HELD: Duration = Duration::from_millis(20);

/// The final frame of a message of bytes or of text, as a server sends it.
const BINARY: u8 = 0x82;
const TEXT: u8 = 0x81;
/// A frame that every client answers by itself.
const PING_FRAME: [u8; 2] = [0x89, 0];
/// The first byte of the message of a topic.
const MESSAGE_DATA: u8 = 1;
/// The first byte of the answer to a call, and the first bytes of a refusal.
const CALL_ANSWER: u8 = 3;
const CALL_FAILURE: &[u8] = br#"{"op":"serviceCallFailure""#;

/// The queue of a client.
#[derive(Debug)]
pub(crate) struct Outbox<'a> {
    waiting: Mutex<Waiting>,
    has_changed: Notify,
    lost: &'a AtomicU64,
    pub(crate) calls: Calls,
}

#[derive(Debug, Default)]
struct Waiting {
    frames: VecDeque<Frame>,
    messages: usize,
    /// Bytes of the messages, and of the other frames.
    bytes: usize,
    other_bytes: usize,
    lost: u64,
    is_over: bool,
}

#[derive(Debug, PartialEq)]
struct Frame {
    bytes: Vec<u8>,
    is_message: bool,
}

impl<'a> Outbox<'a> {
    /// Creates a queue that adds to the number of `lost` messages.
    pub(crate) fn new(lost: &'a AtomicU64) -> Self {
        Self { waiting: Mutex::default(), has_changed: Notify::new(), lost, calls: Calls::default() }
    }

    /// Carries what the server sends to the client, until the server ends, and pings. That the client reads is a sign of life: `pulse`.
    pub(crate) async fn relay(
        &self,
        server: impl AsyncRead + Unpin,
        client: impl AsyncWrite + Unpin,
        pulse: &Notify,
    ) -> Result<()> {
        let filled = async {
            let read = self.fill(BufReader::new(server)).await;
            self.waiting().is_over = true;
            self.has_changed.notify_one();
            Ok(read)
        };
        let (read, ()) = tokio::try_join!(filled, self.empty(client, pulse))?;
        read
    }

    async fn fill(&self, mut server: impl AsyncRead + AsyncBufReadExt + Unpin) -> Result<()> {
        let mut answer = Vec::new();
        while !answer.ends_with(b"\r\n\r\n") {
            if server.read_until(b'\n', &mut answer).await? == 0 {
                break;
            }
        }
        self.push(Frame { bytes: answer, is_message: false })?;
        while let Some((frame, is_of_call)) = frame(&mut server).await? {
            if is_of_call {
                self.calls.end();
            }
            self.push(frame)?;
        }
        Ok(())
    }

    /// Adds a frame, in the place of the oldest messages if there is no room.
    fn push(&self, frame: Frame) -> Result<()> {
        let mut waiting = self.waiting();
        if frame.is_message {
            while waiting.messages > 0
                && (waiting.messages >= MOST_MESSAGES || waiting.bytes + frame.bytes.len() > MOST_BYTES)
            {
                let oldest = waiting.frames.iter().position(|frame| frame.is_message);
                let Some(oldest) = oldest.and_then(|oldest| waiting.frames.remove(oldest)) else { break };
                waiting.messages -= 1;
                waiting.bytes -= oldest.bytes.len();
                waiting.lost += 1;
                self.lost.fetch_add(1, Ordering::Relaxed);
            }
            waiting.messages += 1;
            waiting.bytes += frame.bytes.len();
        } else {
            waiting.other_bytes += frame.bytes.len();
            if waiting.frames.len() - waiting.messages >= MOST_OTHERS || waiting.other_bytes > MOST_BYTES {
                return Err(Error::new(ErrorKind::TimedOut, "it does not read"));
            }
        }
        waiting.frames.push_back(frame);
        self.has_changed.notify_one();
        Ok(())
    }

    fn pop(&self) -> Option<Frame> {
        let mut waiting = self.waiting();
        let frame = waiting.frames.pop_front()?;
        if frame.is_message {
            waiting.messages -= 1;
            waiting.bytes -= frame.bytes.len();
        } else {
            waiting.other_bytes -= frame.bytes.len();
        }
        Some(frame)
    }

    async fn empty(&self, mut client: impl AsyncWrite + Unpin, pulse: &Notify) -> Result<()> {
        let (mut reported, mut next) = (0, Instant::now());
        // After the answer to the request for a WebSocket.
        let mut next_ping = None;
        loop {
            let (lost, is_over) = {
                let waiting = self.waiting();
                (waiting.lost, waiting.is_over)
            };
            let frame = self.pop();
            if lost > reported && (frame.is_none() || Instant::now() >= next) {
                client.write_all(&warning(lost)).await?;
                (reported, next) = (lost, Instant::now() + WARNING);
            }
            let now = Instant::now();
            if next_ping.is_some_and(|at| at <= now) {
                client.write_all(&PING_FRAME).await?;
                next_ping = Some(now + PING);
            }
            match frame {
                Some(frame) => client.write_all(&frame.bytes).await?,
                None if is_over => return Ok(()),
                None => {
                    let wait = next_ping.map_or(Duration::MAX, |at| at.saturating_duration_since(now));
                    let _ = timeout(wait, self.has_changed.notified()).await;
                    continue;
                }
            }
            next_ping.get_or_insert(now + PING);
            if now.elapsed() > HELD {
                pulse.notify_one();
            }
        }
    }

    fn waiting(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The next frame of a server, and whether it ends a call; `None` at the end.
async fn frame(server: &mut (impl AsyncRead + AsyncBufReadExt + Unpin)) -> Result<Option<(Frame, bool)>> {
    if server.fill_buf().await?.is_empty() {
        return Ok(None);
    }
    let (mut bytes, length) = head(server).await?;
    let head = bytes.len();
    // As it comes: a length alone reserves nothing.
    if server.take(length).read_to_end(&mut bytes).await? as u64 != length {
        return Err(Error::from(ErrorKind::UnexpectedEof));
    }
    let (kind, payload) = (bytes[0], &bytes[head..]);
    let is_message = kind == BINARY && payload.first() == Some(&MESSAGE_DATA);
    let is_of_call = (kind == BINARY && payload.first() == Some(&CALL_ANSWER))
        || (kind == TEXT && payload.starts_with(CALL_FAILURE));
    Ok(Some((Frame { bytes, is_message }, is_of_call)))
}

/// The frame of a warning, in the place of the one before.
fn warning(lost: u64) -> Vec<u8> {
    let text = format!(
        r#"{{"op":"status","level":1,"id":"lost","message":"messages lost, the oldest first, as this client reads too slowly: {lost}"}}"#
    );
    // A length above 125 takes two bytes more.
    let mut frame = match u8::try_from(text.len()) {
        Ok(short @ ..126) => vec![TEXT, short],
        _ => [&[TEXT, 126][..], &(text.len() as u16).to_be_bytes()].concat(),
    };
    frame.extend_from_slice(text.as_bytes());
    frame
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(number: u32, length: usize) -> Vec<u8> {
        let mut payload = vec![MESSAGE_DATA];
        payload.extend_from_slice(&number.to_be_bytes());
        payload.resize(length, 0);
        let mut frame = match length {
            0..126 => vec![BINARY, length as u8],
            126..65536 => [&[BINARY, 126][..], &(length as u16).to_be_bytes()].concat(),
            _ => [&[BINARY, 127][..], &(length as u64).to_be_bytes()].concat(),
        };
        frame.extend(payload);
        frame
    }

    fn run<T>(future: impl Future<Output = T>) -> T {
        tokio::runtime::Builder::new_current_thread().enable_time().build().expect("it starts").block_on(future)
    }

    #[test]
    fn frames_are_carried_bit_for_bit() {
        let mut stream = b"HTTP/1.1 101 Switching Protocols\r\na: b\r\n\r\n".to_vec();
        for length in [5, 125, 126, 127, 65535, 65536, 100_000] {
            stream.extend(message(1, length));
            stream.extend(warning(7));
        }
        stream.extend([0x89, 0, 0x88, 2, 3, 0xe8]);
        let (lost, mut carried) = (AtomicU64::new(0), Vec::new());
        run(Outbox::new(&lost).relay(&stream[..], &mut carried, &Notify::new())).expect("it ends");
        assert!(carried == stream);
        // An end within a frame is an error, after all before it.
        let mut carried = Vec::new();
        assert!(run(Outbox::new(&lost).relay(&stream[..stream.len() - 1], &mut carried, &Notify::new())).is_err());
        assert!(carried == stream[..stream.len() - 4]);
    }

    #[test]
    fn the_oldest_messages_are_lost_and_counted_and_nothing_else() {
        for (length, kept) in [(16, MOST_MESSAGES), (1024 * 1024, 15), (MOST_BYTES + 1, 1)] {
            let lost = AtomicU64::new(0);
            let outbox = Outbox::new(&lost);
            let (count, mut sent) = (kept as u32 + 5, Vec::new());
            for number in 0..count {
                if number == 2 {
                    outbox.push(Frame { bytes: vec![TEXT, 0], is_message: false }).expect("there is room");
                }
                let bytes = message(number, length);
                outbox.push(Frame { bytes, is_message: true }).expect("there is room");
            }
            outbox.waiting().is_over = true;
            run(outbox.empty(&mut sent, &Notify::new())).expect("it ends");
            let mut expected = [warning(5), vec![TEXT, 0]].concat();
            (5..count).for_each(|number| expected.extend(message(number, length)));
            assert!(sent == expected, "{length}");
            assert_eq!(lost.into_inner(), 5);
        }
        let lost = AtomicU64::new(0);
        let outbox = Outbox::new(&lost);
        let text = || outbox.push(Frame { bytes: vec![TEXT, 0], is_message: false });
        assert_eq!((0..).take_while(|_| text().is_ok()).count(), MOST_OTHERS);
    }
}
