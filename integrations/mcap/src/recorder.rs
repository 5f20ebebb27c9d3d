//! Writes what a subscription gets.

mod background;
mod options;
#[cfg(test)]
mod tests;

pub use background::BackgroundRecorder;
pub(crate) use options::LIBRARY;
pub use options::{Compression, RecorderOptions};

use crate::error::{RecordingError, RecordingErrorKind, create_error, write_error};
use crate::layout::{Description, Layout, Shared};
use bb_core::message::Schema;
use bb_core::message::codec::ros::{Text, TransformsMessage};
use bb_core::message::codec::{Field, Shape, encode};
use bb_core::{DynamicMessage, DynamicSubscription, WallTime};
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, McapResult, Writer};
use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::{self, BufWriter, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Where a recording goes.
pub(crate) trait Output: Write + Seek + Send {}
impl<T: Write + Seek + Send> Output for T {}

/// The name of the attachment with the robot as URDF.
pub(crate) const URDF: &str = "robot.urdf";
/// The name of the metadata that tell which robot it is.
pub(crate) const ROBOT: &str = "bb.robot";
/// The name of the metadata at the end.
pub(crate) const END: &str = "bb.recorder";

/// What has been recorded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct RecorderReport {
    /// Messages written.
    pub messages: u64,
    /// Messages that the operating system has: they survive the death of the process.
    pub flushed: u64,
    /// Messages lost since the recorder was too slow for the room that its subscription has.
    pub lost: u64,
}

/// Writes what a subscription gets into a file, when its owner says so ([`drain`](Self::drain): on virtual time) or on a
/// thread of its own ([`spawn`](Self::spawn)). Dropping it ends the file.
pub struct Recorder {
    path: PathBuf,
    /// None once the file has its end, or an error came.
    writer: Option<Box<FileWriter>>,
    /// The same file, to wait for the disk.
    to_sync: Option<File>,
    subscription: DynamicSubscription,
    options: RecorderOptions,
    channels: HashMap<&'static str, Channel>,
    report: RecorderReport,
    last_flush: Instant,
    /// The frames, and the URDF, are written with the first message, since they have its time.
    has_begun: bool,
    bytes: Vec<u8>,
}

struct Channel {
    id: u16,
    layout: Layout,
    shared: Shared,
    beside: Option<u16>,
    sequence: u32,
}

impl Recorder {
    /// Creates the file `path` for what `subscription` gets.
    ///
    /// # Errors
    /// The file exists already, or cannot be created.
    pub fn new(
        path: impl AsRef<Path>,
        subscription: DynamicSubscription,
        options: RecorderOptions,
    ) -> Result<Self, RecordingError> {
        let path = path.as_ref();
        let create = |cause: io::Error| RecordingError::new(path, create_error(cause));
        let file = File::create_new(path).map_err(create)?;
        let to_sync = if options.sync { Some(file.try_clone().map_err(create)?) } else { None };
        Self::on(path, Box::new(file), to_sync, subscription, options)
    }

    pub(crate) fn on(
        path: &Path,
        output: Box<dyn Output>,
        to_sync: Option<File>,
        subscription: DynamicSubscription,
        options: RecorderOptions,
    ) -> Result<Self, RecordingError> {
        let fail = |error| RecordingError::new(path, write_error(0, error));
        let mut writer = options.mcap().create(BufWriter::new(output)).map_err(fail)?;
        describe(&mut writer, &options).and_then(|()| writer.flush()).map_err(fail)?;
        Ok(Self {
            path: path.to_owned(),
            writer: Some(Box::new(writer)),
            to_sync,
            subscription,
            options,
            channels: HashMap::new(),
            report: RecorderReport::default(),
            last_flush: Instant::now(),
            has_begun: false,
            bytes: Vec::new(),
        })
    }

    /// Writes all messages that wait now; how many.
    ///
    /// # Errors
    /// The file cannot be written on, the disk is full say. Nothing more is recorded then.
    pub fn drain(&mut self) -> Result<u64, RecordingError> {
        let before = self.report.messages;
        for _ in 0..self.subscription.waiting() {
            let Some(message) = self.subscription.try_recv() else { break };
            self.record(&message)?;
        }
        self.flush_if_due()?;
        Ok(self.report.messages - before)
    }

    /// Hands all that is written to the operating system.
    ///
    /// # Errors
    /// The file cannot be written on.
    pub fn flush(&mut self) -> Result<(), RecordingError> {
        self.guarded(|recorder, writer| {
            writer.flush()?;
            if let Some(file) = &recorder.to_sync {
                file.sync_data()?;
            }
            Ok(())
        })?;
        self.report.flushed = self.report.messages;
        self.last_flush = Instant::now();
        Ok(())
    }

    /// What has been recorded so far.
    pub fn report(&self) -> RecorderReport {
        RecorderReport { lost: self.subscription.lagged(), ..self.report }
    }

    /// Writes what waits, and the end of the file.
    ///
    /// # Errors
    /// The file cannot be written on.
    pub fn finish(mut self) -> Result<RecorderReport, RecordingError> {
        self.end()?;
        Ok(self.report())
    }

    /// Writes on a thread of its own from now on.
    ///
    /// # Errors
    /// The thread cannot be started.
    pub fn spawn(self) -> Result<BackgroundRecorder, RecordingError> {
        BackgroundRecorder::new(self)
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Waits for a message, and writes it and all that wait behind it.
    pub(crate) fn work(&mut self, wait: Duration) -> Result<(), RecordingError> {
        if let Some(message) = self.subscription.recv_timeout(wait.min(self.options.flush_interval)) {
            self.record(&message)?;
        }
        self.drain().map(drop)
    }

    fn record(&mut self, message: &DynamicMessage) -> Result<(), RecordingError> {
        self.guarded(|recorder, writer| recorder.write(message, writer))?;
        self.report.messages += 1;
        self.flush_if_due()
    }

    fn flush_if_due(&mut self) -> Result<(), RecordingError> {
        let unflushed = self.report.messages - self.report.flushed;
        let is_due = unflushed >= self.options.flush_messages.max(1)
            || (unflushed > 0 && self.last_flush.elapsed() >= self.options.flush_interval);
        if is_due { self.flush() } else { Ok(()) }
    }

    /// Calls `write` unless an error came before; after one, nothing more is written.
    fn guarded(
        &mut self,
        write: impl FnOnce(&mut Self, &mut FileWriter) -> McapResult<()>,
    ) -> Result<(), RecordingError> {
        let Some(mut writer) = self.writer.take() else {
            return Err(RecordingError::new(&self.path, RecordingErrorKind::GivenUp));
        };
        match write(self, &mut writer) {
            Ok(()) => {
                self.writer = Some(writer);
                Ok(())
            }
            Err(error) => Err(RecordingError::new(&self.path, write_error(self.report.messages, error))),
        }
    }

    fn write(&mut self, message: &DynamicMessage, writer: &mut FileWriter) -> McapResult<()> {
        let stamp = message.stamp();
        let log_time = nanos(stamp.wall_time);
        if !self.has_begun {
            self.has_begun = true;
            place(writer, &self.options, stamp.wall_time)?;
        }
        let channel = match self.channels.entry(message.path()) {
            std::collections::hash_map::Entry::Occupied(entry) => entry.into_mut(),
            std::collections::hash_map::Entry::Vacant(entry) => {
                let layout = if message.ros_schema().is_some() { Layout::Ros } else { Layout::Exact };
                let shared = Shared::of(&stamp);
                let id = add(writer, &Description::of(message, layout, &shared))?;
                entry.insert(Channel { id, layout, shared, beside: None, sequence: 0 })
            }
        };
        let sequence = channel.sequence;
        channel.sequence = sequence.wrapping_add(1);
        let header = |channel_id| MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
        if channel.layout == Layout::Ros && !(channel.shared.gives(&stamp) && message.is_exact_as_ros()) {
            let beside = match channel.beside {
                Some(beside) => beside,
                None => {
                    let id = add(writer, &Description::of(message, Layout::Beside, &channel.shared))?;
                    *channel.beside.insert(id)
                }
            };
            self.bytes.clear();
            message.encode(&mut self.bytes);
            writer.write_to_known_channel(&header(beside), &self.bytes)?;
        }
        self.bytes.clear();
        match channel.layout {
            Layout::Ros => _ = message.encode_as_ros(&mut self.bytes),
            Layout::Exact | Layout::Beside => message.encode(&mut self.bytes),
        }
        writer.write_to_known_channel(&header(channel.id), &self.bytes)
    }

    fn end(&mut self) -> Result<(), RecordingError> {
        self.drain()?;
        let report = self.report();
        self.guarded(|_, writer| {
            let counts = [("messages", report.messages), ("lost", report.lost)];
            let metadata = counts.map(|(key, count)| (key.to_owned(), count.to_string())).into();
            writer.write_metadata(&Metadata { name: END.to_owned(), metadata })?;
            writer.finish()?;
            Ok(())
        })?;
        let Some(writer) = self.writer.take() else { return Ok(()) };
        let mut file = writer.into_inner();
        let ended = file.flush().and_then(|()| self.to_sync.as_ref().map_or(Ok(()), File::sync_all));
        self.report.flushed = report.messages;
        ended.map_err(|cause| {
            RecordingError::new(&self.path, RecordingErrorKind::Write { messages: report.messages, cause })
        })
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        if self.writer.is_some() {
            // There is nobody to tell.
            let _ = self.end();
        }
    }
}

impl std::fmt::Debug for Recorder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Recorder").field("path", &self.path).field("report", &self.report()).finish_non_exhaustive()
    }
}

type FileWriter = Writer<BufWriter<Box<dyn Output>>>;

fn add(writer: &mut FileWriter, channel: &Description) -> McapResult<u16> {
    let Description { topic, schema, metadata } = channel;
    let schema = writer.add_schema(&schema.name, Schema::ENCODING, schema.text.as_bytes())?;
    writer.add_channel(schema, topic, Schema::MESSAGE_ENCODING, metadata)
}

/// Which robot it is, at the beginning.
fn describe(writer: &mut FileWriter, options: &RecorderOptions) -> McapResult<()> {
    let Some(robot) = &options.robot else { return Ok(()) };
    let metadata = BTreeMap::from([("name".to_owned(), robot.name.to_owned())]);
    writer.write_metadata(&Metadata { name: ROBOT.to_owned(), metadata })?;
    writer.attach(&Attachment {
        log_time: 0,
        create_time: 0,
        name: URDF.to_owned(),
        media_type: "application/xml".to_owned(),
        data: Cow::Borrowed(robot.urdf.as_bytes()),
    })
}

/// Where its frames are, and what it looks like, on the topics where viewers expect that.
fn place(writer: &mut FileWriter, options: &RecorderOptions, time: WallTime) -> McapResult<()> {
    let Some(robot) = &options.robot else { return Ok(()) };
    latched(writer, "/robot_description", time, &Text { data: robot.urdf.clone() })?;
    latched(writer, "/tf_static", time, &TransformsMessage::at_rest(robot.topology, time))
}

/// A message that whoever comes late gets as well.
fn latched<T: Field>(writer: &mut FileWriter, topic: &str, time: WallTime, message: &T) -> McapResult<()> {
    let Shape::Struct(shape) = T::SHAPE else { return Ok(()) };
    let metadata = BTreeMap::from([("offered_qos_profiles".to_owned(), LATCHED.to_owned())]);
    let schema = Schema::new(shape.name, T::SHAPE);
    let id = add(writer, &Description { topic: topic.to_owned(), schema, metadata })?;
    let mut bytes = Vec::new();
    encode(message, &mut bytes);
    let log_time = nanos(time);
    let header = MessageHeader { channel_id: id, sequence: 0, log_time, publish_time: log_time };
    writer.write_to_known_channel(&header, &bytes)
}

/// Keep the last, reliable, transient local: as ROS's recorder writes it.
const LATCHED: &str = "- history: 1
  depth: 1
  reliability: 1
  durability: 1
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 9223372036
    nsec: 854775807
  liveliness: 1
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 854775807
  avoid_ros_namespace_conventions: false
";

/// MCAP has no time before 1970.
fn nanos(time: WallTime) -> u64 {
    u64::try_from(time.as_unix_nanos()).unwrap_or(0)
}
