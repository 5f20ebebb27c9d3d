//! Bags of ROS 1: every message as that of ROS 2.

use super::entry::{Entry, What};
use bb_core::message::Schema;
use bb_mcap::Ros1Definition;
use rosbag::{ChunkRecord, MessageRecord, RosBag};
use std::collections::HashMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

/// A topic of the bag, or why its messages are left out.
type Channel = (Arc<str>, Result<(Ros1Definition, Arc<Schema>), String>);

/// Passes on the messages of a bag in its order. Returns what was left out.
pub(super) fn each(file: &Path, out: &mut dyn FnMut(Entry) -> Result<(), String>) -> Result<Vec<String>, String> {
    indexed(file)?;
    let bag = RosBag::new(file).map_err(|error| format!("cannot be read: {error}"))?;
    let mut channels: HashMap<u32, Channel> = HashMap::new();
    let mut left_out: Vec<(Arc<str>, u64, String)> = Vec::new();
    for record in bag.chunk_records() {
        let ChunkRecord::Chunk(chunk) = record.map_err(damaged)? else { continue };
        for record in chunk.messages() {
            match record.map_err(damaged)? {
                MessageRecord::Connection(connection) => {
                    channels.entry(connection.id).or_insert_with(|| {
                        let definition = Ros1Definition::parse(connection.tp, connection.message_definition);
                        let definition = definition.map(|definition| {
                            let schema = Arc::new(definition.schema().clone());
                            (definition, schema)
                        });
                        (connection.topic.into(), definition)
                    });
                }
                MessageRecord::MessageData(message) => {
                    let id = message.conn_id;
                    let (topic, definition) = channels
                        .get(&id)
                        .ok_or_else(|| format!("it is damaged: no connection has the number {id}"))?;
                    let mut data = Vec::new();
                    let converted = match definition {
                        Ok((definition, schema)) => {
                            definition.convert(message.data, &mut data).map(|()| Arc::clone(schema))
                        }
                        Err(fault) => Err(fault.clone()),
                    };
                    let schema = match converted {
                        Ok(schema) => schema,
                        Err(fault) => {
                            match left_out.iter_mut().find(|(other, ..)| other == topic) {
                                Some((_, count, _)) => *count += 1,
                                None => left_out.push((Arc::clone(topic), 1, fault)),
                            }
                            continue;
                        }
                    };
                    let time_ns =
                        i64::try_from(message.time).map_err(|_| format!("{} is no time", message.time))?;
                    out(Entry { time_ns, what: What::Encoded { topic: Arc::clone(topic), schema, data } })?;
                }
            }
        }
    }
    let said = |(topic, count, fault): (Arc<str>, u64, String)| format!("{count} on {topic} left out: {fault}");
    Ok(left_out.into_iter().map(said).collect())
}

/// Checks that the index is where the head of the file says: a recorder that was killed leaves zero there, of which the
/// reader makes a slice.
fn indexed(file: &Path) -> Result<(), String> {
    const NAME: &[u8] = b"index_pos=";
    let failed = |error: std::io::Error| format!("cannot be read: {error}");
    let mut start = Vec::new();
    let mut opened = File::open(file).map_err(failed)?;
    let length = opened.metadata().map_err(failed)?.len();
    opened.by_ref().take(4096).read_to_end(&mut start).map_err(failed)?;
    let place = start.windows(NAME.len()).position(|window| window == NAME);
    let bytes = place.and_then(|place| start.get(place + NAME.len()..)?.first_chunk());
    // The head of a bag fills 4 kB.
    match bytes.map(|bytes| u64::from_le_bytes(*bytes)) {
        Some(index) if index > 4096 && index <= length => Ok(()),
        _ => Err("it has no index, as when a recorder was killed; `rosbag reindex` of ROS 1 makes one".into()),
    }
}

fn damaged(error: rosbag::Error) -> String {
    format!("it is damaged: {error}; `rosbag reindex` of ROS 1 may mend it")
}
