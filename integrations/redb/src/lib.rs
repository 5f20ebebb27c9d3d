//! Keeps a robot's parameters over restarts of the program, in a file of the embedded database [redb](https://www.redb.org).
//!
//! Each set of values is one transaction. A program that is killed, or a machine that loses power, while it writes leaves the
//! last complete set: the file holds two versions of its root, with checksums, and the newer valid one counts.
//!
//! ```
//! use bb_core::prelude::*;
//! use bb_redb::RedbStore;
//!
//! robot! {
//!     robot Rig;
//!     parameters { gains { kp: f64 = 1.0, range: 0.0..=10.0; } }
//!     link base;
//! }
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let file = std::env::temp_dir().join(format!("bb-redb-doc-{}.redb", std::process::id()));
//! let mut builder = Rig::builder();
//! for unused in builder.keep_parameters(RedbStore::open(&file)?)? {
//!     eprintln!("{unused}");
//! }
//! let rig = builder.simulate()?; // or `start()`
//! rig.set_parameter(rig::param::gains::kp, 4.5)?;
//! rig.stop();
//!
//! // The next run of the program.
//! let mut builder = Rig::builder();
//! builder.keep_parameters(RedbStore::open(&file)?)?;
//! assert_eq!(builder.simulate()?.parameter(rig::param::gains::kp), 4.5);
//! # std::fs::remove_file(&file)?;
//! # Ok(())
//! # }
//! ```

// A robot must not stop because of an unexpected value.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

use bb_core::Fault;
use bb_core::component::ParameterStore;
use bb_core::event::ParameterValue;
use bb_core::message::codec::{from_json, to_json};
use redb::{Database, ReadableDatabase, ReadableTable, TableDefinition, TableError};
use std::collections::BTreeMap;
use std::fmt;
use std::io::ErrorKind;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

/// Values by path, as JSON, which other programs can read.
const PARAMETERS: TableDefinition<'_, &str, &str> = TableDefinition::new("parameters");

/// A [`ParameterStore`] in a file. One program at a time may have it open.
pub struct RedbStore {
    /// Name of the store in errors.
    name: String,
    database: Database,
}

impl RedbStore {
    /// Opens the store, or creates it. The folder must exist.
    ///
    /// # Errors
    /// The file cannot be opened, is not such a store, or is open in another program. An empty file is no store: what it held is
    /// lost, and it has to be removed to start afresh.
    pub fn open(file: impl AsRef<Path>) -> Result<Self, Fault> {
        let file = file.as_ref();
        let name = file.display().to_string();
        match std::fs::metadata(file) {
            Ok(data) if data.is_file() && data.len() == 0 => {
                let message =
                    "the file is empty: if there is nothing to recover, remove it to begin with default values";
                return Err(fault(&name, message));
            }
            Err(error) if error.kind() == ErrorKind::NotFound => {
                create(file).map_err(|error| fault(&name, error))?
            }
            _ => {}
        }
        let mut builder = Database::builder();
        // Without the check, a damaged file may cause a panic later.
        builder.set_check_integrity_on_open(true);
        let database = builder.create(file).map_err(|error| fault(&name, error))?;
        Ok(Self { name, database })
    }

    fn read(&self) -> Result<BTreeMap<String, ParameterValue>, Fault> {
        let failed = |error: redb::Error| fault(&self.name, error);
        let transaction = self.database.begin_read().map_err(|error| failed(error.into()))?;
        let table = match transaction.open_table(PARAMETERS) {
            Ok(table) => table,
            // Nothing was stored yet.
            Err(TableError::TableDoesNotExist(_)) => return Ok(BTreeMap::new()),
            Err(error) => return Err(failed(error.into())),
        };
        let mut values = BTreeMap::new();
        for row in table.iter().map_err(|error| failed(error.into()))? {
            let (path, json) = row.map_err(|error| failed(error.into()))?;
            let value = from_json(json.value()).map_err(|error| fault(&self.name, error))?;
            values.insert(path.value().to_owned(), value);
        }
        Ok(values)
    }

    fn write(&self, values: &BTreeMap<String, ParameterValue>) -> Result<(), redb::Error> {
        let transaction = self.database.begin_write()?;
        {
            let mut table = transaction.open_table(PARAMETERS)?;
            table.retain(|path, _| values.contains_key(path))?;
            for (path, value) in values {
                let json = to_json(value);
                let is_known = table.get(path.as_str())?.is_some_and(|known| known.value() == json);
                if !is_known {
                    table.insert(path.as_str(), json.as_str())?;
                }
            }
        }
        Ok(transaction.commit()?)
    }
}

/// Creates an empty store, unless another program does so at the same time. A file that is written only in part is not a store, so
/// it gets its name once it is complete.
fn create(file: &Path) -> Result<(), redb::Error> {
    // Nobody else writes to this one.
    static CREATED: AtomicU64 = AtomicU64::new(0);
    let number = CREATED.fetch_add(1, Ordering::Relaxed);
    let mut part = file.as_os_str().to_owned();
    part.push(format!(".{}-{number}.part", std::process::id()));
    let part = Path::new(&part);
    // A killed program, whose number this one has got, may have left its own.
    match std::fs::remove_file(part) {
        Err(error) if error.kind() != ErrorKind::NotFound => return Err(error.into()),
        _ => {}
    }
    drop(Database::create(part)?);
    publish(part, file)?;
    // The name, too, must survive a loss of power.
    #[cfg(unix)]
    {
        let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty());
        std::fs::File::open(folder.unwrap_or(Path::new(".")))?.sync_all()?;
    }
    Ok(())
}

/// Gives the file `part` the name `file`, unless there is one: another program may have created it, and have it open.
fn publish(part: &Path, file: &Path) -> std::io::Result<()> {
    // Unlike `rename`, it does not replace a file.
    match std::fs::hard_link(part, file) {
        Ok(()) => {}
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
        // A file system without hard links, such as FAT.
        Err(_) if !file.exists() => return std::fs::rename(part, file),
        Err(_) => {}
    }
    std::fs::remove_file(part)
}

impl ParameterStore for RedbStore {
    fn load(&mut self) -> Result<BTreeMap<String, ParameterValue>, Fault> {
        self.read()
    }

    fn store(&mut self, values: &BTreeMap<String, ParameterValue>) -> Result<(), Fault> {
        self.write(values).map_err(|error| fault(&self.name, error))
    }
}

impl fmt::Debug for RedbStore {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("RedbStore").field(&self.name).finish()
    }
}

fn fault(name: &str, error: impl fmt::Display) -> Fault {
    Fault::new(format!("{name}: {error}"))
}

#[cfg(test)]
mod tests;
