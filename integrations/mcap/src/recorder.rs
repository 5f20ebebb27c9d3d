//! Writes the messages of subscriptions.

mod background;
mod names;
mod options;
#[cfg(test)]
mod tests;
mod viewers;

pub use background::BackgroundRecorder;
pub(crate) use options::LIBRARY;
pub use options::{Compression, RecorderOptions};

use crate::clock::{CLOCK, Clock};
use crate::error::{RecordingError, RecordingErrorKind, create_error, write_error};
use crate::file::LIMIT;
use crate::layout::{Description, Layout, Shared};
use bb_core::joints::{ViewerChannel, ViewerMessage, ViewerMessages};
use bb_core::message::{Schema, Stamp};
use bb_core::{DynamicMessage, DynamicSubscription};
use mcap::records::{MessageHeader, Metadata};
use mcap::{McapError, Writer};
use names::Names;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::fs::File;
use std::io::{self, BufWriter, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
pub(crate) use viewers::{channel_of, nanos};
use viewers::{describe, view};

/// The destination of a recording.
pub(crate) trait Output: Write + Seek + Send {}
impl<T: Write + Seek + Send> Output for T {}

/// The name of the attachment with the robot as URDF.
pub(crate) const URDF: &str = "robot.urdf";
/// The name of the metadata that identify the robot.
pub(crate) const ROBOT: &str = "bb.robot";
/// The name of the metadata at the end.
pub(crate) const END: &str = "bb.recorder";

/// Counts of a recording.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct RecorderReport {
    /// Messages written.
    pub messages: u64,
    /// Messages handed to the operating system: they survive the end of the process.
    pub flushed: u64,
    /// Messages lost because the recorder was too slow for the capacity of its subscriptions.
    pub lost: u64,
    /// Messages left out because they exceed 128 MiB, which is more than readers accept.
    pub too_large: u64,
}

/// Writes the messages of a subscription to a file, either when [`drain`](Self::drain) is called, as for a
/// simulation, or on its own thread ([`spawn`](Self::spawn)). Dropping it completes the file.
pub struct Recorder {
    path: PathBuf,
    /// `None` once the file is complete, or after an error.
    writer: Option<Box<FileWriter>>,
    /// Handle of the same file, to look after it.
    file: Option<Watched>,
    /// Subscriptions that are recorded: the first is waited for, the others are polled.
    subscriptions: Vec<DynamicSubscription>,
    options: RecorderOptions,
    channels: HashMap<&'static str, Channel>,
    report: RecorderReport,
    last_flush: Instant,
    names: Names,
    viewers: Option<ViewerMessages>,
    /// Known from the first message on. The frames and the URDF are written with it, since they have its time.
    clock: Option<Clock>,
    viewed: HashMap<ViewerChannel, Viewed>,
    bytes: Bytes,
}

/// The file that is written.
pub(crate) struct Watched {
    file: File,
    /// Length at the last check.
    length: u64,
}

struct Channel {
    id: u16,
    layout: Layout,
    shared: Shared,
    beside: Option<u16>,
    companion: Option<u16>,
    sequence: u32,
}

/// A channel for viewers.
struct Viewed {
    id: u16,
    sequence: u32,
}

/// A message as bytes; kept to reuse the allocations.
#[derive(Default)]
struct Bytes {
    main: Vec<u8>,
    beside: Vec<u8>,
    companion: Vec<u8>,
}

/// The largest message that is written, in bytes: together with accompanying data, a chunk must not exceed the
/// readers' limit.
const LARGEST: usize = LIMIT as usize / 2;

impl Recorder {
    /// Creates the file `path` for what `subscription` receives.
    ///
    /// # Errors
    /// The file exists already or cannot be created, or two of the paths publish different types that would have the same
    /// name in the file.
    pub fn new(
        path: impl AsRef<Path>,
        subscription: DynamicSubscription,
        options: RecorderOptions,
    ) -> Result<Self, RecordingError> {
        let path = path.as_ref();
        let create = |cause: io::Error| RecordingError::new(path, create_error(cause));
        let file = File::create_new(path).map_err(create)?;
        let watched = Watched { file: file.try_clone().map_err(create)?, length: 0 };
        let recorder = Self::on(path, Box::new(file), Some(watched), subscription, options);
        recorder.inspect_err(|_| {
            // It is empty, and another attempt needs its name.
            let _ = std::fs::remove_file(path);
        })
    }

    pub(crate) fn on(
        path: &Path,
        output: Box<dyn Output>,
        file: Option<Watched>,
        subscription: DynamicSubscription,
        options: RecorderOptions,
    ) -> Result<Self, RecordingError> {
        let fail = |error| RecordingError::new(path, write_error(0, error));
        let mut names = Names::default();
        take_names(&mut names, &subscription).map_err(|kind| RecordingError::new(path, kind))?;
        let viewers = options.robot.as_ref();
        let viewers = viewers.map(|robot| ViewerMessages::new(robot.name, robot.topology, options.body.clone()));
        let mut writer = options.mcap().create(BufWriter::new(output)).map_err(fail)?;
        describe(&mut writer, &options, viewers.as_ref()).and_then(|()| writer.flush()).map_err(fail)?;
        Ok(Self {
            path: path.to_owned(),
            writer: Some(Box::new(writer)),
            file,
            subscriptions: vec![subscription],
            options,
            channels: HashMap::new(),
            report: RecorderReport::default(),
            last_flush: Instant::now(),
            names,
            viewers,
            clock: None,
            viewed: HashMap::new(),
            bytes: Bytes::default(),
        })
    }

    /// Records the messages of this subscription, too. Each subscription has its own queue, so frequent messages do not
    /// displace rare ones when the disk is slow. A message that several subscriptions receive is recorded several
    /// times.
    ///
    /// # Errors
    /// A path publishes a type that would have the same name in the file as a different one.
    pub fn also(mut self, subscription: DynamicSubscription) -> Result<Self, RecordingError> {
        if let Err(kind) = take_names(&mut self.names, &subscription) {
            let path = self.path.clone();
            drop(self);
            // Like `new`, leave no file.
            let _ = std::fs::remove_file(&path);
            return Err(RecordingError::new(&path, kind));
        }
        self.subscriptions.push(subscription);
        Ok(self)
    }

    /// Writes all waiting messages, and returns their number.
    ///
    /// # Errors
    /// Writing failed, for example because the disk is full. Nothing more is recorded then.
    pub fn drain(&mut self) -> Result<u64, RecordingError> {
        let before = self.report.messages;
        for index in 0..self.subscriptions.len() {
            for _ in 0..self.subscriptions[index].waiting() {
                let Some(message) = self.subscriptions[index].try_recv() else { break };
                self.record(&message)?;
            }
        }
        self.flush_if_due()?;
        Ok(self.report.messages - before)
    }

    /// Hands everything that was written to the operating system.
    ///
    /// # Errors
    /// Writing failed, or another program has removed or truncated the file.
    pub fn flush(&mut self) -> Result<(), RecordingError> {
        self.guarded(|recorder, writer| {
            recorder.check_file()?;
            writer.flush()?;
            if recorder.options.sync
                && let Some(watched) = &recorder.file
            {
                watched.file.sync_data()?;
            }
            recorder.check_file()
        })?;
        self.report.flushed = self.report.messages;
        self.last_flush = Instant::now();
        Ok(())
    }

    /// Returns a report of what has been recorded so far.
    pub fn report(&self) -> RecorderReport {
        let lost = self.subscriptions.iter().map(DynamicSubscription::lagged).sum();
        RecorderReport { lost, ..self.report }
    }

    /// Writes the waiting messages and the end of the file.
    ///
    /// # Errors
    /// Writing failed, or another program has removed or truncated the file.
    pub fn finish(mut self) -> Result<RecorderReport, RecordingError> {
        self.end()?;
        Ok(self.report())
    }

    /// Continues on its own thread.
    ///
    /// # Errors
    /// The thread cannot be started.
    pub fn spawn(self) -> Result<BackgroundRecorder, RecordingError> {
        BackgroundRecorder::new(self)
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Waits for a message, and writes it and all that are queued after it.
    pub(crate) fn work(&mut self, wait: Duration) -> Result<(), RecordingError> {
        let wait = wait.min(self.options.flush_interval);
        if let Some(message) = self.subscriptions.first().and_then(|first| first.recv_timeout(wait)) {
            self.record(&message)?;
        }
        self.drain().map(drop)
    }

    fn record(&mut self, message: &DynamicMessage) -> Result<(), RecordingError> {
        let is_written = self.guarded(|recorder, writer| recorder.write(message, writer))?;
        match is_written {
            true => self.report.messages += 1,
            false => self.report.too_large += 1,
        }
        self.flush_if_due()
    }

    fn flush_if_due(&mut self) -> Result<(), RecordingError> {
        let unflushed = self.report.messages - self.report.flushed;
        let is_due = unflushed >= self.options.flush_messages.max(1)
            || (unflushed > 0 && self.last_flush.elapsed() >= self.options.flush_interval);
        if is_due { self.flush() } else { Ok(()) }
    }

    /// Calls `write` unless an earlier call failed; after an error, nothing more is written.
    fn guarded<T>(
        &mut self,
        write: impl FnOnce(&mut Self, &mut FileWriter) -> Result<T, WriteFault>,
    ) -> Result<T, RecordingError> {
        let Some(mut writer) = self.writer.take() else {
            return Err(RecordingError::new(&self.path, RecordingErrorKind::GivenUp));
        };
        match write(self, &mut writer) {
            Ok(value) => {
                self.writer = Some(writer);
                Ok(value)
            }
            Err(fault) => Err(self.failed(fault)),
        }
    }

    fn failed(&self, fault: WriteFault) -> RecordingError {
        let kind = match fault {
            WriteFault::File(error) => write_error(self.report.flushed, error),
            WriteFault::Message(kind) => kind,
        };
        RecordingError::new(&self.path, kind)
    }

    /// Writes a message, and the derived messages for viewers; returns false and writes nothing if it is too large.
    fn write(&mut self, message: &DynamicMessage, writer: &mut FileWriter) -> Result<bool, WriteFault> {
        let stamp = message.stamp();
        let clock = match self.clock {
            Some(clock) => clock,
            None => self.begin(&stamp, writer)?,
        };
        let channel = match self.channels.entry(message.path()) {
            Entry::Occupied(entry) => entry.into_mut(),
            Entry::Vacant(entry) => {
                let layout = if message.ros_schema().is_some() { Layout::Ros } else { Layout::Exact };
                let shared = Shared::of(&stamp);
                let id = add(writer, &mut self.names, &Description::of(message, layout, &shared))?;
                entry.insert(Channel { id, layout, shared, beside: None, companion: None, sequence: 0 })
            }
        };
        let Bytes { main, beside, companion } = &mut self.bytes;
        for bytes in [&mut *main, beside, companion] {
            bytes.clear();
        }
        match channel.layout {
            Layout::Ros => {
                message.encode_as_ros(main);
                message.encode_companion(companion);
                if !channel.shared.gives(&clock, &stamp) || !message.is_exact_as_ros() {
                    message.encode(beside);
                }
            }
            _ => message.encode(main),
        }
        if main.len() + beside.len() + companion.len() > LARGEST {
            return Ok(false);
        }
        let (sequence, log_time) = (channel.sequence, nanos(clock.logged(&stamp)));
        channel.sequence = sequence.wrapping_add(1);
        let header = |channel_id| MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
        for (layout, id, bytes) in
            [(Layout::Beside, &mut channel.beside, beside), (Layout::Companion, &mut channel.companion, companion)]
        {
            if bytes.is_empty() {
                continue;
            }
            let id = match *id {
                Some(id) => id,
                None => {
                    let description = Description::of(message, layout, &channel.shared);
                    *id.insert(add(writer, &mut self.names, &description)?)
                }
            };
            writer.write_to_known_channel(&header(id), bytes)?;
        }
        writer.write_to_known_channel(&header(channel.id), main)?;
        if self.options.transforms
            && let Some(viewers) = &mut self.viewers
            && let Some(following) = viewers.following(message)
        {
            self.view(&following, log_time, writer)?;
        }
        Ok(true)
    }

    /// Writes the data that precedes the first message, with its time.
    fn begin(&mut self, first: &Stamp, writer: &mut FileWriter) -> Result<Clock, WriteFault> {
        let clock = *self.clock.insert(Clock::of(first));
        writer.write_metadata(&Metadata { name: CLOCK.to_owned(), metadata: clock.to_metadata() })?;
        let time = first.wall_time;
        let first = self.viewers.as_ref().map_or_else(Vec::new, |viewers| viewers.first(time));
        let with_transforms = self.options.transforms;
        for message in first.iter().filter(|message| with_transforms || message.channel.is_latched()) {
            self.view(message, nanos(time), writer)?;
        }
        Ok(clock)
    }

    /// Writes a message for viewers.
    fn view(&mut self, message: &ViewerMessage, log_time: u64, writer: &mut FileWriter) -> Result<(), WriteFault> {
        let channel = match self.viewed.entry(message.channel) {
            Entry::Occupied(entry) => entry.into_mut(),
            Entry::Vacant(entry) => entry.insert(Viewed { id: view(writer, message.channel)?, sequence: 0 }),
        };
        let header =
            MessageHeader { channel_id: channel.id, sequence: channel.sequence, log_time, publish_time: log_time };
        channel.sequence = channel.sequence.wrapping_add(1);
        Ok(writer.write_to_known_channel(&header, &message.bytes)?)
    }

    /// Checks that the file is still there, with all that was in it at the last check.
    fn check_file(&mut self) -> Result<(), WriteFault> {
        let Some(watched) = &mut self.file else { return Ok(()) };
        let found = watched.file.metadata()?;
        #[cfg(unix)]
        let is_removed = std::os::unix::fs::MetadataExt::nlink(&found) == 0;
        #[cfg(not(unix))]
        let is_removed = false;
        let change = match (is_removed, found.len() < watched.length) {
            (true, _) => "removed",
            (false, true) => "truncated",
            (false, false) => {
                watched.length = found.len();
                return Ok(());
            }
        };
        Err(WriteFault::Message(RecordingErrorKind::Taken { messages: self.report.messages, change }))
    }

    fn end(&mut self) -> Result<(), RecordingError> {
        self.drain()?;
        let report = self.report();
        self.guarded(|recorder, writer| {
            recorder.check_file()?;
            let counts = [("messages", report.messages), ("lost", report.lost), ("too_large", report.too_large)];
            let metadata = counts.map(|(key, count)| (key.to_owned(), count.to_string())).into();
            writer.write_metadata(&Metadata { name: END.to_owned(), metadata })?;
            writer.finish()?;
            Ok(())
        })?;
        let Some(writer) = self.writer.take() else { return Ok(()) };
        let mut file = writer.into_inner();
        let to_sync = self.file.as_ref().filter(|_| self.options.sync);
        let ended = file.flush().and_then(|()| to_sync.map_or(Ok(()), |watched| watched.file.sync_all()));
        ended.map_err(|cause| {
            RecordingError::new(&self.path, RecordingErrorKind::Write { messages: report.flushed, cause })
        })?;
        self.check_file().map_err(|fault| self.failed(fault))?;
        self.report.flushed = report.messages;
        Ok(())
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        if self.writer.is_some() {
            // The error cannot be reported to anyone.
            let _ = self.end();
        }
    }
}

impl std::fmt::Debug for Recorder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Recorder").field("path", &self.path).field("report", &self.report()).finish_non_exhaustive()
    }
}

pub(crate) type FileWriter = Writer<BufWriter<Box<dyn Output>>>;

/// Reason for which nothing more is written.
enum WriteFault {
    File(McapError),
    Message(RecordingErrorKind),
}

impl From<McapError> for WriteFault {
    fn from(error: McapError) -> Self {
        Self::File(error)
    }
}

impl From<io::Error> for WriteFault {
    fn from(error: io::Error) -> Self {
        Self::File(error.into())
    }
}

/// Refuses two types with one name before the run rather than at the first message, when a recorder's errors are
/// easily missed.
fn take_names(names: &mut Names, subscription: &DynamicSubscription) -> Result<(), RecordingErrorKind> {
    for (path, schemas) in subscription.schemas() {
        schemas.iter().try_for_each(|schema| names.take(path, schema))?;
    }
    Ok(())
}

fn add(writer: &mut FileWriter, names: &mut Names, channel: &Description) -> Result<u16, WriteFault> {
    let Description { topic, path, schema, metadata } = channel;
    names.take(path, schema).map_err(WriteFault::Message)?;
    let schema = writer.add_schema(&schema.name, Schema::ENCODING, schema.text.as_bytes())?;
    Ok(writer.add_channel(schema, topic, Schema::MESSAGE_ENCODING, metadata)?)
}
