//! MCAP files, record by record: the one framing under bags, recordings and repairs.

mod channels;
mod chunk;
mod compression;
mod fields;
mod frame;
mod record;
mod records;

pub(crate) use channels::{Channel, Channels, full_name};
pub(crate) use compression::unpack;
pub(crate) use frame::{FRAME, LIMIT, unframe};
pub(crate) use record::Record;
pub(crate) use records::Records;
