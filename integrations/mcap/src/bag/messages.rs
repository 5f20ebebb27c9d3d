//! The messages of chosen topics, one by one.

use super::message::{BagMessage, MessageKind, Wanted, check};
use crate::error::{RecordingError, RecordingErrorKind};
use crate::file::{Channels, Record, Records, unpack};
use std::collections::HashMap;
use std::fmt;
use std::iter::FusedIterator;
use std::path::Path;
use std::sync::Arc;

/// The messages of chosen topics in the order of the file; see [`Bag::messages`](crate::Bag::messages).
///
/// The iterator ends after an error of the file. A message with a malformed payload is an error only when it is
/// decoded.
pub struct BagMessages {
    path: Arc<Path>,
    /// `None` once it is over, which closes the file.
    records: Option<Records>,
    channels: Channels,
    wanted: Vec<Wanted>,
    only_cdr: bool,
    /// The source of messages instead of records, in a bag that is a database.
    #[cfg(feature = "sqlite")]
    rows: Option<super::sqlite::Rows>,
    /// Routes of the messages of each channel met so far; `None` for unwanted ones.
    routes: HashMap<u16, Option<Route>>,
}

/// A channel of a wanted topic.
struct Route {
    /// Index into the wanted topics.
    topic: usize,
    kind: MessageKind,
}

impl BagMessages {
    pub(crate) fn open(path: &Path, wanted: Vec<Wanted>, only_cdr: bool) -> Result<Self, RecordingError> {
        #[cfg(feature = "sqlite")]
        if super::sqlite::is_database(path) {
            let rows = super::sqlite::Rows::open(path, &wanted).map_err(|kind| RecordingError::new(path, kind))?;
            return Ok(Self {
                rows: Some(rows).filter(|_| !wanted.is_empty()),
                ..Self::of(path, None, wanted, only_cdr)
            });
        }
        let records = Records::open(path).map_err(|kind| RecordingError::new(path, kind))?;
        let records = Some(records).filter(|_| !wanted.is_empty());
        Ok(Self::of(path, records, wanted, only_cdr))
    }

    fn of(path: &Path, records: Option<Records>, wanted: Vec<Wanted>, only_cdr: bool) -> Self {
        Self {
            path: path.into(),
            records,
            channels: Channels::default(),
            wanted,
            only_cdr,
            #[cfg(feature = "sqlite")]
            rows: None,
            routes: HashMap::new(),
        }
    }

    fn step(&mut self) -> Result<Option<BagMessage>, RecordingErrorKind> {
        #[cfg(feature = "sqlite")]
        if let Some(rows) = &mut self.rows {
            return rows.next(&self.path, &mut self.wanted);
        }
        let Some(records) = &mut self.records else {
            return Ok(None);
        };
        while records.advance()? {
            let record = records.record()?;
            let Record::Message { channel, log_time, data, .. } = record else {
                self.channels.define(record).map_err(|fault| records.corrupt(fault))?;
                continue;
            };
            let route = match self.routes.get(&channel) {
                Some(route) => route,
                None => {
                    let route = match self.channels.get(channel) {
                        None => {
                            return Err(records.corrupt(format!("a message of the unknown channel {channel}")));
                        }
                        Some(c) => match self.wanted.iter().position(|wanted| wanted.topic == c.topic) {
                            None => None,
                            Some(topic) => {
                                if self.only_cdr {
                                    check(&c.topic, &c.encoding)?;
                                }
                                let (schema, encoding) = (Arc::clone(&c.schema), Arc::clone(&c.encoding));
                                Some(Route { topic, kind: MessageKind { schema, encoding } })
                            }
                        },
                    };
                    self.routes.entry(channel).or_insert(route)
                }
            };
            let Some(route) = route else { continue };
            let Wanted { topic, count, .. } = &mut self.wanted[route.topic];
            *count += 1;
            let data = unpack(data).map_err(|fault| RecordingErrorKind::Payload {
                topic: topic.to_string(),
                schema: route.kind.schema.to_string(),
                message: *count,
                log_time_ns: log_time,
                byte: records.byte(),
                fault,
            })?;
            let data = data.into_owned();
            let byte = records.byte();
            return Ok(Some(BagMessage::new(topic, &route.kind, log_time, data, &self.path, *count, byte)));
        }
        // A chunk's length and type are not covered by a checksum. Damage there can hide the chunk, and only the
        // summary reveals it.
        match self.wanted.iter().find(|wanted| wanted.count < wanted.expected) {
            Some(Wanted { topic, expected, count }) => {
                Err(records.corrupt(format!("it ends with {count} of the {expected} messages on {topic}")))
            }
            None => Ok(None),
        }
    }
}

impl Iterator for BagMessages {
    type Item = Result<BagMessage, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        let item = self.step().map_err(|kind| RecordingError::new(&self.path, kind)).transpose();
        if !matches!(item, Some(Ok(_))) {
            self.records = None;
            #[cfg(feature = "sqlite")]
            {
                self.rows = None;
            }
        }
        item
    }
}

impl FusedIterator for BagMessages {}

impl fmt::Debug for BagMessages {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let at = self.records.as_ref().map(Records::byte);
        f.debug_struct("BagMessages")
            .field("path", &self.path)
            .field("topics", &self.wanted)
            .field("byte", &at)
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_iterator_can_go_to_another_thread() {
        fn check<T: Send + 'static>() {}
        check::<BagMessages>();
        check::<BagMessage>();
    }
}
