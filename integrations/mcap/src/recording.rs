//! The contents of a recording.

mod messages;

pub use messages::{AllMessages, Messages, RecordedMessage};

use crate::clock::{CLOCK, Clock};
use crate::error::{RecordingError, RecordingErrorKind};
use crate::file::{Channel, Channels, Record, Records};
use crate::layout::{LAYOUT, Layout, Names, PATH, PAYLOAD, Shared};
use crate::recorder::{END, LIBRARY, ROBOT, URDF};
use bb_core::Payload;
use messages::Wanted;
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The messages recorded at one path.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct RecordedChannel {
    /// The path it was published at.
    pub path: String,
    /// The name of its payload's type.
    pub payload: String,
    /// The name of its definition: `sensor_msgs/msg/Imu`.
    pub schema: String,
    /// Definition of the type.
    pub definition: String,
    /// The number of messages, in a damaged file before the damage.
    pub messages: u64,
    pub(crate) id: u16,
    pub(crate) layout: Layout,
    pub(crate) names: Names,
    pub(crate) clock: Clock,
    /// The channel of messages that ROS's layout cannot represent, and its definition.
    pub(crate) beside: Option<(u16, String)>,
    /// The channel of the second message, and its definition.
    pub(crate) companion: Option<(u16, String)>,
}

/// A recording that this crate has written.
#[derive(Clone, Debug)]
pub struct Recording {
    path: PathBuf,
    channels: Vec<Arc<RecordedChannel>>,
    robot: Option<String>,
    urdf: Option<String>,
    lost: Option<u64>,
    broken: Option<Arc<RecordingError>>,
}

impl Recording {
    /// Reads a recording once, to find its contents. One that is cut off opens as well; see [`broken`](Self::broken).
    ///
    /// # Errors
    /// The file is missing, unreadable, not MCAP, or was written by another program.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, RecordingError> {
        let path = path.as_ref();
        let fail = |kind| RecordingError::new(path, kind);
        let mut records = Records::open_all(path).map_err(fail)?;
        let mut scan = Scan::default();
        let broken = loop {
            match records.advance().and_then(|is_one| is_one.then(|| records.record()).transpose()) {
                Ok(Some(Record::Header { library, .. })) if !library.starts_with(LIBRARY) => {
                    return Err(fail(RecordingErrorKind::Foreign { library: library.to_owned() }));
                }
                Ok(Some(record)) => {
                    if let Err(fault) = scan.take(record) {
                        break Some(records.corrupt(fault));
                    }
                }
                Ok(None) => break None,
                Err(kind) => break Some(kind),
            }
        };
        let broken = broken.map(|kind| Arc::new(fail(kind)));
        let Scan { channels, counts, robot, urdf, lost, clock, .. } = scan;
        let mut channels: Vec<_> = channels.into_values().collect();
        channels.sort_by_key(|channel| channel.id);
        let (mut channels, more): (Vec<_>, Vec<_>) =
            channels.into_iter().partition(|channel| matches!(channel.layout, Layout::Ros | Layout::Exact));
        for channel in &mut channels {
            channel.messages = counts.get(&channel.id).copied().unwrap_or(0);
            let of_layout = |layout: Layout| {
                let found = more.iter().find(|more| more.path == channel.path && more.layout == layout);
                found.map(|more| (more.id, more.definition.clone()))
            };
            (channel.beside, channel.companion) = (of_layout(Layout::Beside), of_layout(Layout::Companion));
            channel.clock = clock;
        }
        let channels = channels.into_iter().map(Arc::new).collect();
        Ok(Self { path: path.to_owned(), channels, robot, urdf, lost, broken })
    }

    /// The file, as it was given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The paths with recorded messages.
    pub fn channels(&self) -> &[Arc<RecordedChannel>] {
        &self.channels
    }

    /// The robot's name, if the recorder knew it.
    pub fn robot(&self) -> Option<&str> {
        self.robot.as_deref()
    }

    /// The robot as URDF, if the recorder knew it.
    pub fn urdf(&self) -> Option<&str> {
        self.urdf.as_deref()
    }

    /// The number of messages lost because the recorder was too slow; unknown in a file without an end.
    pub fn lost(&self) -> Option<u64> {
        self.lost
    }

    /// Returns the place and the cause of the break at which the file is cut off, if it is.
    pub fn broken(&self) -> Option<&RecordingError> {
        self.broken.as_deref()
    }

    /// The messages published at `path`, bit for bit; the last item of a file that is cut off is the error.
    ///
    /// # Errors
    /// Nothing was recorded there, or another payload, or the payload had other fields then.
    pub fn messages<T: Payload>(&self, path: &str) -> Result<Messages<T>, RecordingError> {
        let fail = |kind| RecordingError::new(&self.path, kind);
        let Some(channel) = self.channels.iter().find(|channel| channel.path == path) else {
            let paths: Vec<_> = self.channels.iter().map(|channel| format!("`{}`", channel.path)).collect();
            let paths = if paths.is_empty() { "none".to_owned() } else { paths.join(", ") };
            return Err(fail(RecordingErrorKind::NoPath { path: path.to_owned(), paths }));
        };
        channel.check::<T>().map_err(fail)?;
        let wanted = Wanted::of(std::slice::from_ref(channel));
        Ok(Messages::new(AllMessages::open(&self.path, wanted).map_err(fail)?))
    }

    /// All messages in the order in which they were written; the last item of a file that is cut off is the error.
    ///
    /// # Errors
    /// The file can no longer be opened.
    pub fn all(&self) -> Result<AllMessages, RecordingError> {
        let wanted = Wanted::of(&self.channels);
        AllMessages::open(&self.path, wanted).map_err(|kind| RecordingError::new(&self.path, kind))
    }
}

#[derive(Default)]
struct Scan {
    defined: Channels,
    channels: BTreeMap<u16, RecordedChannel>,
    counts: HashMap<u16, u64>,
    robot: Option<String>,
    urdf: Option<String>,
    lost: Option<u64>,
    clock: Clock,
}

impl Scan {
    fn take(&mut self, record: Record<'_>) -> Result<(), String> {
        match record {
            Record::Message { channel, .. } => *self.counts.entry(channel).or_default() += 1,
            Record::Metadata { name: ROBOT, metadata } => self.robot = metadata.get("name").cloned(),
            Record::Metadata { name: CLOCK, metadata } => {
                self.clock = Clock::from_metadata(&metadata).ok_or("the metadata of the clock are malformed")?;
            }
            Record::Metadata { name: END, metadata } => {
                self.lost = metadata.get("lost").and_then(|lost| lost.parse().ok());
            }
            Record::Attachment { name: URDF, data, .. } => {
                self.urdf = std::str::from_utf8(data).ok().map(str::to_owned);
            }
            other => {
                if let Some((id, channel)) = self.defined.define(other)?
                    && let Some(recorded) = RecordedChannel::of(id, channel)?
                {
                    self.channels.insert(id, recorded);
                }
            }
        }
        Ok(())
    }
}

impl RecordedChannel {
    /// A channel published by a robot; `None` if the channel exists only for viewers.
    fn of(id: u16, channel: &Channel) -> Result<Option<Self>, String> {
        let Channel { topic, schema, definition, metadata, .. } = channel;
        let Some(path) = metadata.get(PATH) else { return Ok(None) };
        let malformed = || format!("the channel `{topic}` is malformed");
        let shared = Shared::from_metadata(metadata).ok_or_else(malformed)?;
        Ok(Some(Self {
            path: path.clone(),
            payload: metadata.get(PAYLOAD).cloned().unwrap_or_default(),
            schema: schema.to_string(),
            definition: std::str::from_utf8(definition).map_err(|_| malformed())?.to_owned(),
            messages: 0,
            id,
            layout: metadata.get(LAYOUT).and_then(|name| Layout::named(name)).ok_or_else(malformed)?,
            names: Names::of(&shared).map_err(|error| error.to_string())?,
            clock: Clock::default(),
            beside: None,
            companion: None,
        }))
    }
}
