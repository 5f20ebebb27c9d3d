//! Bags in SQLite, which `ros2 bag record` wrote by default until Iron: files that end in `.db3`.

use super::Topic;
use super::message::{BagMessage, MessageKind, Wanted};
use crate::error::RecordingErrorKind;
use crate::file::{LIMIT, full_name, unpack};
use rusqlite::{Connection, OpenFlags, OptionalExtension, params};
use std::collections::{HashMap, VecDeque};
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

/// The first bytes of an SQLite database.
const MAGIC: &[u8] = b"SQLite format 3\0";

/// Number of messages that are listed at once. Their data is read one by one.
const PAGE: i64 = 1000;

/// Returns whether a file is a database; false for an unreadable one, so that the MCAP reader reports why.
pub(super) fn is_database(path: &Path) -> bool {
    let mut start = [0; MAGIC.len()];
    // Checked before opening: opening a pipe would wait for a writer.
    path.is_file()
        && std::fs::File::open(path).and_then(|mut file| file.read_exact(&mut start)).is_ok()
        && start == MAGIC
}

/// The topics of a database. The number of messages of each is not known without reading all of it.
pub(super) fn topics(path: &Path) -> Result<Vec<Topic>, RecordingErrorKind> {
    let rows = read_topics(&open(path).map_err(fault(0))?).map_err(fault(0))?;
    Ok(rows.into_iter().map(|(_, topic)| topic).collect())
}

fn open(path: &Path) -> rusqlite::Result<Connection> {
    Connection::open_with_flags(path, OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX)
}

fn read_topics(connection: &Connection) -> rusqlite::Result<Vec<(i64, Topic)>> {
    let mut statement =
        connection.prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY id")?;
    let definitions = definitions(connection)?;
    let topics = statement.query_map([], |row| {
        let name: String = row.get(1)?;
        let schema: String = row.get(2)?;
        let encoding: String = row.get(3)?;
        let (definition_encoding, definition) = definitions.get(&schema).cloned().unwrap_or_default();
        let topic = Topic {
            name: name.into(),
            schema: full_name(&schema).into(),
            encoding: encoding.into(),
            definition: definition.into(),
            definition_encoding: definition_encoding.into(),
            is_own: false,
            messages: None,
        };
        Ok((row.get(0)?, topic))
    })?;
    topics.collect()
}

/// The definitions of types and their formats, by name; bags before Iron have none.
fn definitions(connection: &Connection) -> rusqlite::Result<HashMap<String, (String, String)>> {
    if !connection.table_exists(None, "message_definitions")? {
        return Ok(HashMap::new());
    }
    let mut statement =
        connection.prepare("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions")?;
    let definitions = statement.query_map([], |row| Ok((row.get(0)?, (row.get(1)?, row.get(2)?))))?;
    definitions.collect()
}

fn fault(messages: u64) -> impl Fn(rusqlite::Error) -> RecordingErrorKind {
    move |cause| RecordingErrorKind::Database { messages, cause: cause.to_string() }
}

/// The messages of chosen topics, by time.
pub(super) struct Rows {
    connection: Connection,
    /// The chosen topics, by their numbers in the database: the index among those wanted, and the type.
    chosen: HashMap<i64, (usize, MessageKind)>,
    page: VecDeque<Row>,
    /// The start of the next page: after this time and number.
    last: (i64, i64),
    messages: u64,
}

struct Row {
    id: i64,
    topic: i64,
    time_ns: i64,
    /// Bytes.
    length: i64,
}

impl Rows {
    pub(super) fn open(path: &Path, wanted: &[Wanted]) -> Result<Self, RecordingErrorKind> {
        let connection = open(path).map_err(fault(0))?;
        let topics = read_topics(&connection).map_err(fault(0))?;
        let chosen = topics.into_iter().filter_map(|(id, topic)| {
            let place = wanted.iter().position(|wanted| wanted.topic == topic.name)?;
            Some((id, (place, MessageKind { schema: topic.schema, encoding: topic.encoding })))
        });
        let chosen = chosen.collect();
        Ok(Self { connection, chosen, page: VecDeque::new(), last: (i64::MIN, i64::MIN), messages: 0 })
    }

    /// The next message of the wanted topics.
    pub(super) fn next(
        &mut self,
        path: &Arc<Path>,
        wanted: &mut [Wanted],
    ) -> Result<Option<BagMessage>, RecordingErrorKind> {
        loop {
            let Some(Row { id, topic, time_ns, length }) = self.page.pop_front() else {
                if !self.turn().map_err(fault(self.messages))? {
                    return Ok(None);
                }
                continue;
            };
            let messages = self.messages;
            self.messages += 1;
            let Some((place, kind)) = self.chosen.get(&topic) else { continue };
            // No message has a negative length.
            let length = u64::try_from(length).unwrap_or(u64::MAX);
            if length > LIMIT {
                return Err(RecordingErrorKind::TooLarge { messages, byte: 0, length, limit: LIMIT });
            }
            let data = self.data(id).map_err(fault(messages))?;
            let Wanted { topic, count, .. } = &mut wanted[*place];
            *count += 1;
            let log_time_ns = u64::try_from(time_ns).unwrap_or(0);
            let data = unpack(&data).map_err(|fault| RecordingErrorKind::Payload {
                topic: topic.to_string(),
                schema: kind.schema.to_string(),
                message: *count,
                log_time_ns,
                byte: 0,
                fault,
            })?;
            let data = data.into_owned();
            return Ok(Some(BagMessage::new(topic, kind, log_time_ns, data, path, *count, 0)));
        }
    }

    /// Looks up the next messages; false if there are none.
    fn turn(&mut self) -> rusqlite::Result<bool> {
        // In a form that can use the index of the timestamps.
        let mut statement = self.connection.prepare_cached(
            "SELECT id, topic_id, timestamp, length(CAST(data AS BLOB)) FROM messages
             WHERE timestamp >= ?1 AND (timestamp > ?1 OR id > ?2)
             ORDER BY timestamp, id LIMIT ?3",
        )?;
        let (time, id) = self.last;
        let rows = statement.query_map(params![time, id, PAGE], |row| {
            Ok(Row { id: row.get(0)?, topic: row.get(1)?, time_ns: row.get(2)?, length: row.get(3)? })
        })?;
        for row in rows {
            self.page.push_back(row?);
        }
        self.last = self.page.back().map_or(self.last, |row| (row.time_ns, row.id));
        Ok(!self.page.is_empty())
    }

    fn data(&self, id: i64) -> rusqlite::Result<Vec<u8>> {
        let mut statement = self.connection.prepare_cached("SELECT data FROM messages WHERE id = ?1")?;
        statement.query_row([id], |row| row.get(0)).optional().map(Option::unwrap_or_default)
    }
}
