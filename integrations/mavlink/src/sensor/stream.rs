//! A stream of messages of one kind, and its faults.

use crate::link::{Inbox, Link, Peer, Received};
use bb_core::time::Clock;
use bb_core::{Fault, MonotonicTime, SensorContext};
use std::sync::Arc;
use std::time::Duration;

/// Time for which one read waits.
const WAIT: Duration = Duration::from_millis(50);
/// The number of messages that may be queued for a driver; more is a flood.
const CAPACITY: usize = 64;
/// Shortest period at which a flood is logged.
const COMPLAINT: Duration = Duration::from_secs(10);

/// Messages of one peer.
#[derive(Debug)]
pub(super) struct Stream {
    link: Link,
    inbox: Arc<Inbox>,
    peer: Peer,
    name: &'static str,
    /// Time for which it may be silent.
    timeout: Duration,
    robot: Clock,
    path: &'static str,
    opened: MonotonicTime,
    /// Times of the last message, and of the last one with a value, on the machine's clock.
    message: Option<MonotonicTime>,
    value: Option<MonotonicTime>,
    /// Reason for which the last message had no value.
    without: &'static str,
    dropped: u64,
    complained: Option<MonotonicTime>,
}

impl Stream {
    /// Opens the link, and listens there. The first of `messages` is the one the driver needs.
    pub(super) fn open(
        link: &str,
        peer: Peer,
        messages: &[(&'static str, u32)],
        timeout: Duration,
        context: &SensorContext,
    ) -> Result<Self, Fault> {
        let link = Link::open(link)?;
        let ids: Vec<u32> = messages.iter().map(|(_, id)| *id).collect();
        Ok(Self {
            inbox: link.listen(peer, &ids, CAPACITY),
            peer,
            name: messages.first().map_or("", |(name, _)| name),
            timeout,
            robot: context.clock().clone(),
            path: context.path(),
            opened: link.now(),
            link,
            message: None,
            value: None,
            without: "",
            dropped: 0,
            complained: None,
        })
    }

    /// The next message and its arrival on the robot's clock; waits briefly. It reads one message, however many are
    /// queued.
    ///
    /// # Errors
    /// The link has failed, or there has been no message, or none with a value, for too long.
    pub(super) fn next(&mut self) -> Result<Option<Received>, Fault> {
        let received = self.inbox.receive(WAIT)?;
        self.watch_flood();
        let Some(received) = received else {
            self.check_silence()?;
            return Ok(None);
        };
        if self.robot.is_virtual() {
            let arrival = self.robot.now();
            return Ok(Some(Received { arrival, ..received }));
        }
        Ok(Some(received))
    }

    /// The message was of the kind the driver needs, and had a value.
    pub(super) fn has_value(&mut self) {
        (self.message, self.value) = (Some(self.link.now()), Some(self.link.now()));
    }

    /// The message was of the kind the driver needs, but had no value.
    ///
    /// # Errors
    /// No message has had a value for too long.
    pub(super) fn has_none(&mut self, why: &'static str) -> Result<(), Fault> {
        (self.message, self.without) = (Some(self.link.now()), why);
        self.check_silence()
    }

    /// A fault of this stream.
    pub(super) fn fault(&self, what: impl std::fmt::Display) -> Fault {
        Fault::new(format!("{}: {what}", self.name))
    }

    pub(super) fn link(&self) -> &Link {
        &self.link
    }

    /// Checks that messages with values arrive.
    ///
    /// # Errors
    /// There has been no message, or none with a value, for too long.
    pub(super) fn check_silence(&self) -> Result<(), Fault> {
        let now = self.link.now();
        let since = |time: MonotonicTime| now.seconds_since(time);
        let waited = since(self.value.unwrap_or(self.opened));
        if waited <= self.timeout.as_secs_f64() {
            return Ok(());
        }
        let name = self.name;
        let fault = match (self.message, self.value) {
            (Some(message), _) if since(message) <= self.timeout.as_secs_f64() => {
                format!("{name} arrives, but for {waited:.1} s without a value that can be used: {}", self.without)
            }
            (Some(message), _) => format!("no {name} for {:.1} s: {}", since(message), self.heartbeats(now)),
            (None, _) => {
                format!("no {name} in the {waited:.1} s since the driver started: {}", self.heartbeats(now))
            }
        };
        Err(Fault::new(fault))
    }

    fn heartbeats(&self, now: MonotonicTime) -> String {
        match self.link.last_heartbeat(self.peer) {
            None => "nor has a heartbeat come".to_owned(),
            Some(last) => {
                let age_s = now.seconds_since(last);
                // They come once a second.
                let still =
                    if age_s <= HEARTBEAT_LOST { "heartbeats still come" } else { "heartbeats have stopped too" };
                format!("{still}, the last {age_s:.1} s ago")
            }
        }
    }

    fn watch_flood(&mut self) {
        let dropped = self.inbox.dropped();
        if dropped == self.dropped {
            return;
        }
        let now = self.link.now();
        if self.complained.is_none_or(|last| now.seconds_since(last) >= COMPLAINT.as_secs_f64()) {
            let (path, message, lost) = (self.path, self.name, dropped - self.dropped);
            tracing::warn!(path, message, lost, "messages come faster than they are read");
            self.complained = Some(now);
            self.dropped = dropped;
        }
    }
}

/// The time after which the specification considers a component gone: four or five heartbeats, s.
const HEARTBEAT_LOST: f64 = 5.0;

/// Returns the one of `names` that an option selects.
///
/// # Errors
/// There is none.
pub(super) fn choose<'a, T>(option: &str, text: &str, names: &'a [(&'static str, T)]) -> Result<&'a T, Fault> {
    let found = names.iter().find(|(name, _)| *name == text).map(|(_, value)| value);
    found.ok_or_else(|| {
        let known: Vec<_> = names.iter().map(|(name, _)| format!("`{name}`")).collect();
        Fault::permanent(format!("{option} is `{text}`: write {}", known.join(" or ")))
    })
}
