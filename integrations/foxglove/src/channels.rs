//! The robot's topics as channels, and the additional channels that viewers expect. The robot's topic is subscribed to while a client
//! is subscribed to the channel.

use bb_core::joints::{ViewerChannel, ViewerMessage, ViewerMessages};
use bb_core::message::Schema;
use bb_core::{Bus, Overflow, Select, WallTime};
use foxglove::websocket::{ChannelView, Client, ServerListener};
use foxglove::{ChannelId, Context, FoxgloveError, PartialMetadata, RawChannel};
use std::collections::{HashMap, HashSet};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::task::AbortHandle;

/// Largest number of messages of a topic that wait to be encoded.
const WAITING: usize = 16_384;

/// Origin of the messages of a channel.
#[derive(Clone, Copy, Debug)]
enum Source {
    /// Messages of a path, encoded as in recordings.
    Path {
        path: &'static str,
        is_ros: bool,
    },
    /// Companion messages of a path.
    Companion(&'static str),
    Viewer(ViewerChannel),
}

/// A channel and the clients that are subscribed to it.
struct Entry {
    channel: Arc<RawChannel>,
    source: Source,
    clients: usize,
    /// The task that encodes messages while a client is subscribed.
    task: Option<AbortHandle>,
}

/// All channels of a robot.
pub(crate) struct Channels {
    bus: Bus,
    pub(crate) context: Arc<Context>,
    entries: Mutex<HashMap<ChannelId, Entry>>,
    /// Number of encoded messages.
    pub(crate) encoded: AtomicU64,
    /// Number of messages that came faster than they were encoded, or that slow clients have lost.
    pub(crate) lost: AtomicU64,
}

impl Channels {
    pub(crate) fn new(bus: Bus, context: Arc<Context>) -> Result<Arc<Self>, FoxgloveError> {
        let channels = Arc::new(Self {
            bus,
            context,
            entries: Mutex::default(),
            encoded: AtomicU64::default(),
            lost: AtomicU64::default(),
        });
        for channel in ViewerChannel::ALL {
            channels.add(channel.topic(), channel.schema(), Source::Viewer(channel))?;
        }
        channels.refresh()?;
        Ok(channels)
    }

    /// Adds the channels of paths that have been created since.
    pub(crate) fn refresh(&self) -> Result<(), FoxgloveError> {
        let path_of = |entry: &Entry| match entry.source {
            Source::Path { path, .. } => Some(path),
            _ => None,
        };
        let known: HashSet<&str> = lock(&self.entries).values().filter_map(path_of).collect();
        if self.bus.paths().iter().all(|path| known.contains(path)) {
            return Ok(());
        }
        for topic in self.bus.description().topics.iter().filter(|topic| !known.contains(topic.path)) {
            let (path, layouts) = (topic.path, topic.layouts);
            let (name, schema) = layouts.channel(path);
            self.add(&name, schema, Source::Path { path, is_ros: layouts.ros_name().is_some() })?;
            if let Some((name, schema)) = layouts.companion_channel(path) {
                self.add(&name, schema, Source::Companion(path))?;
            }
        }
        Ok(())
    }

    fn add(&self, topic: &str, schema: Schema, source: Source) -> Result<(), FoxgloveError> {
        // Clients may subscribe as soon as the channel is built: they find it once the lock is released.
        let mut entries = lock(&self.entries);
        let schema = foxglove::Schema::new(schema.name, Schema::ENCODING, schema.text.into_bytes());
        let channel = self.context.channel_builder(topic).message_encoding(Schema::MESSAGE_ENCODING).schema(schema);
        let channel = channel.build_raw()?;
        entries.insert(channel.id(), Entry { channel, source, clients: 0, task: None });
        Ok(())
    }

    /// Encodes and logs the messages of a channel until the task is aborted.
    async fn encode(self: Arc<Self>, channel: Arc<RawChannel>, source: Source) {
        let path = match source {
            Source::Path { path, .. } | Source::Companion(path) => Some(path),
            Source::Viewer(_) => None,
        };
        let select = path.map_or(Select::All, Select::Path);
        let mut messages = self.bus.subscribe_any(select, None, Overflow::DropOldest { capacity: WAITING });
        let mut viewers = self.viewers();
        let mut lost = 0;
        while let Some(message) = messages.recv_async().await {
            let mut bytes = Vec::new();
            let is_encoded = match source {
                Source::Path { is_ros: true, .. } => message.encode_as_ros(&mut bytes),
                Source::Path { is_ros: false, .. } => {
                    message.encode(&mut bytes);
                    true
                }
                Source::Companion(_) => message.encode_companion(&mut bytes),
                Source::Viewer(_) => viewers.following(&message).map(|message| bytes = message.bytes).is_some(),
            };
            if is_encoded {
                self.log(&channel, &bytes, message.stamp().wall_time, None);
            }
            let lagged = messages.lagged();
            if lagged > lost {
                self.lost.fetch_add(lagged - lost, Ordering::Relaxed);
                tracing::warn!(
                    lost = lagged - lost,
                    topic = channel.topic(),
                    "messages came faster than they are encoded"
                );
                lost = lagged;
            }
            // The clients share this thread, which a fast path would otherwise keep busy.
            tokio::task::yield_now().await;
        }
    }

    /// Sends a client the initial messages of a channel.
    fn send_first(&self, client: &Client, channel: &RawChannel, viewer: ViewerChannel) {
        let clock = self.bus.clock();
        let now = clock.wall_at(clock.now());
        for ViewerMessage { channel: other, bytes } in self.viewers().first(now) {
            if other == viewer {
                self.log(channel, &bytes, now, Some(client));
            }
        }
    }

    fn log(&self, channel: &RawChannel, bytes: &[u8], time: WallTime, client: Option<&Client>) {
        self.encoded.fetch_add(1, Ordering::Relaxed);
        // The protocol has no times before 1970.
        let log_time = Some(u64::try_from(time.as_unix_nanos()).unwrap_or(0));
        let sink = client.and_then(Client::sink_id);
        channel.log_with_meta_to_sink(bytes, PartialMetadata { log_time }, sink);
    }

    fn viewers(&self) -> ViewerMessages {
        ViewerMessages::new(self.bus.description().robot, self.bus.topology(), None)
    }
}

/// Notifies the channels of subscriptions, on the server's thread.
pub(crate) struct Watch(pub(crate) Arc<Channels>);

impl ServerListener for Watch {
    fn on_subscribe(&self, client: Client, view: ChannelView) {
        let channels = &self.0;
        let mut entries = lock(&channels.entries);
        let Some(entry) = entries.get_mut(&view.id()) else { return };
        entry.clients += 1;
        if let Source::Viewer(viewer) = entry.source {
            channels.send_first(&client, &entry.channel, viewer);
            if viewer.is_latched() {
                return;
            }
        }
        if entry.task.is_none() {
            let task = Arc::clone(channels).encode(Arc::clone(&entry.channel), entry.source);
            entry.task = Some(tokio::spawn(task).abort_handle());
        }
    }

    fn on_unsubscribe(&self, _: Client, view: ChannelView) {
        let mut entries = lock(&self.0.entries);
        let Some(entry) = entries.get_mut(&view.id()) else { return };
        entry.clients = entry.clients.saturating_sub(1);
        if entry.clients == 0
            && let Some(task) = entry.task.take()
        {
            task.abort();
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
