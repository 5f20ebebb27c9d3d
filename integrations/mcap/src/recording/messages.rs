//! The messages of a recording, read lazily.

use super::RecordedChannel;
use crate::error::{RecordingError, RecordingErrorKind};
use crate::file::{Record, Records};
use crate::layout::{Layout, Shared};
use bb_core::message::Schema;
use bb_core::message::codec::{decode, decode_as_ros, decode_companion};
use bb_core::{Payload, Stamped, WallTime};
use std::collections::HashMap;
use std::fmt;
use std::marker::PhantomData;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A message whose payload type is known only to its reader.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct RecordedMessage {
    /// The path it was published at.
    pub channel: Arc<RecordedChannel>,
    /// Time of publication, by the recording's clock: the wall time, unless the machine's date was set after the first message. A time
    /// before 1970 becomes the epoch.
    pub time: WallTime,
    /// Encoded according to the channel's definition.
    pub data: Vec<u8>,
    /// The complete message, if ROS's layout cannot represent it.
    exact: Option<Vec<u8>>,
    /// The second message, if ROS has two.
    companion: Option<Vec<u8>>,
}

impl RecordedMessage {
    /// The message as it was published, bit for bit.
    ///
    /// # Errors
    /// Its payload is not a `T`, or its bytes are damaged.
    pub fn decode<T: Payload>(&self) -> Result<Stamped<T>, RecordingErrorKind> {
        self.channel.check::<T>()?;
        self.read()
    }

    fn read<T: Payload>(&self) -> Result<Stamped<T>, RecordingErrorKind> {
        let channel = &self.channel;
        let damaged = |cause| RecordingErrorKind::Message { path: channel.path.clone(), cause };
        let exact = |bytes: &[u8]| {
            let mut message: Stamped<T> = decode(bytes).map_err(damaged)?;
            message.wall_time = channel.clock.published(message.wall_time);
            Ok(message)
        };
        match (&self.exact, channel.layout) {
            (Some(bytes), _) => exact(bytes),
            (None, Layout::Ros) => {
                let (mut payload, wall_time) = decode_as_ros(&self.data).map_err(damaged)?;
                if let Some(companion) = &self.companion {
                    decode_companion(&mut payload, companion).map_err(damaged)?;
                }
                let wall_time = channel.clock.published(wall_time);
                Ok(Shared::stamp(&channel.clock, wall_time, &channel.names).message(payload))
            }
            (None, _) => exact(&self.data),
        }
    }
}

impl RecordedChannel {
    /// Checks that its messages have the current fields of `T`.
    pub(crate) fn check<T: Payload>(&self) -> Result<(), RecordingErrorKind> {
        let exact = Stamped::<T>::schema();
        let now = match self.layout {
            Layout::Ros => Stamped::<T>::ros_schema().unwrap_or_else(|| exact.clone()),
            _ => exact.clone(),
        };
        let Schema { name, text } = &now;
        let is_same = self.payload == T::NAME
            && self.schema == *name
            && self.definition == *text
            && self.beside.as_ref().is_none_or(|(_, definition)| *definition == exact.text)
            && self.companion.as_ref().is_none_or(|(_, definition)| {
                Stamped::<T>::ros_companion().is_some_and(|(_, schema)| schema.text == *definition)
            });
        if is_same {
            return Ok(());
        }
        let (recorded, now) = match self.payload == T::NAME {
            true => (format!("`{}` with other fields", self.payload), format!("another: {}", exact.text)),
            false => (format!("`{}`", self.payload), format!("`{name}`")),
        };
        Err(RecordingErrorKind::OtherPayload { path: self.path.clone(), recorded, asked: T::NAME, now })
    }
}

/// The channels that are read.
#[derive(Debug)]
pub(crate) struct Wanted {
    by_id: HashMap<u16, Role>,
}

#[derive(Debug)]
enum Role {
    Main(Arc<RecordedChannel>),
    /// Messages that complete those of the channel with this number.
    Beside(u16),
    /// Likewise.
    Companion(u16),
}

impl Wanted {
    pub(crate) fn of(channels: &[Arc<RecordedChannel>]) -> Self {
        let mut by_id = HashMap::new();
        for channel in channels {
            if let Some((beside, _)) = &channel.beside {
                by_id.insert(*beside, Role::Beside(channel.id));
            }
            if let Some((companion, _)) = &channel.companion {
                by_id.insert(*companion, Role::Companion(channel.id));
            }
            by_id.insert(channel.id, Role::Main(Arc::clone(channel)));
        }
        Self { by_id }
    }
}

/// Messages of several paths, in the order of the file.
pub struct AllMessages {
    path: PathBuf,
    records: Records,
    wanted: Wanted,
    /// Data written beside the next message of a channel, by channel.
    beside: HashMap<u16, Numbered>,
    companions: HashMap<u16, Numbered>,
}

/// The number of a message, and the data that belongs to it.
type Numbered = (u32, Vec<u8>);

impl AllMessages {
    pub(crate) fn open(path: &Path, wanted: Wanted) -> Result<Self, RecordingErrorKind> {
        Ok(Self {
            path: path.to_owned(),
            records: Records::open(path)?,
            wanted,
            beside: HashMap::new(),
            companions: HashMap::new(),
        })
    }

    fn advance(&mut self) -> Result<Option<RecordedMessage>, RecordingErrorKind> {
        while self.records.advance()? {
            let Record::Message { channel, sequence, log_time, data, .. } = self.records.record()? else {
                continue;
            };
            match self.wanted.by_id.get(&channel) {
                None => {}
                Some(Role::Beside(of)) => _ = self.beside.insert(*of, (sequence, data.to_vec())),
                Some(Role::Companion(of)) => _ = self.companions.insert(*of, (sequence, data.to_vec())),
                Some(Role::Main(main)) => {
                    let of_this = |found: Option<Numbered>| {
                        found.filter(|(number, _)| *number == sequence).map(|(_, bytes)| bytes)
                    };
                    let exact = of_this(self.beside.remove(&channel));
                    let companion = of_this(self.companions.remove(&channel));
                    let time = WallTime::from_unix_nanos(i64::try_from(log_time).unwrap_or(i64::MAX));
                    return Ok(Some(RecordedMessage {
                        channel: Arc::clone(main),
                        time: main.clock.published(time),
                        data: data.to_vec(),
                        exact,
                        companion,
                    }));
                }
            }
        }
        Ok(None)
    }
}

impl Iterator for AllMessages {
    type Item = Result<RecordedMessage, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.advance().map_err(|kind| RecordingError::new(&self.path, kind)).transpose()
    }
}

impl fmt::Debug for AllMessages {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("AllMessages").field("path", &self.path).finish_non_exhaustive()
    }
}

/// Messages of one path.
#[derive(Debug)]
pub struct Messages<T> {
    all: AllMessages,
    payload: PhantomData<fn() -> T>,
}

impl<T> Messages<T> {
    pub(crate) fn new(all: AllMessages) -> Self {
        Self { all, payload: PhantomData }
    }
}

impl<T: Payload> Iterator for Messages<T> {
    type Item = Result<Stamped<T>, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        let message = match self.all.next()? {
            Ok(message) => message.read(),
            Err(error) => return Some(Err(error)),
        };
        Some(message.map_err(|kind| RecordingError::new(&self.all.path, kind)))
    }
}
