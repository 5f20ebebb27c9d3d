//! The files to convert, as named on the command line or in a description beside them.

use super::cells::{Table, Times};
use super::columns::{Columns, Quantity};
use super::entry::Entry;
use super::{nmea, rtklib, ulog};
use serde::Deserialize;
use std::collections::VecDeque;
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

/// A file, and what is said of it.
#[derive(Clone, Debug, Default)]
pub(super) struct Input {
    pub(super) file: PathBuf,
    /// Columns of a CSV.
    pub(super) columns: Vec<Quantity>,
    /// Hz, of a CSV without times.
    pub(super) rate: Option<f64>,
    /// Topic of the fixes.
    pub(super) topic: Option<String>,
}

/// The formats that are told by their first bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Csv,
    Ros1,
    Ulog,
    Nmea,
    Rtklib,
    /// A description of several files.
    Description,
}

impl Input {
    /// `FILE MAP…`, separated by spaces. The name of the file may have spaces: the map begins with the first word that
    /// has a `=`.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let starts = text.match_indices(' ').map(|(at, _)| at);
        let is_word_of_map = |at: &usize| text[at + 1..].split(' ').next().is_some_and(|word| word.contains('='));
        let is_file = Path::new(text).exists();
        let end = starts.into_iter().find(is_word_of_map).filter(|_| !is_file).unwrap_or(text.len());
        let (file, map) = text.split_at(end);
        let mut input = Self { file: file.trim_end().into(), ..Self::default() };
        input.map(map)?;
        Ok(input)
    }

    /// Adds `time=1:ns gyr=2-4`, and `topic=/rtk`.
    fn map(&mut self, map: &str) -> Result<(), String> {
        for word in map.split_whitespace() {
            match word.strip_prefix("topic=") {
                Some(topic) => self.topic = Some(topic.to_owned()),
                None => self.columns.push(word.parse()?),
            }
        }
        Ok(())
    }

    /// Checks that the format has what is said of the file.
    pub(super) fn check(&self, format: Format) -> Result<(), String> {
        let name = match format {
            Format::Csv => return Ok(()),
            Format::Ros1 => "a bag of ROS 1 has",
            Format::Ulog => "a log of PX4 has",
            Format::Nmea => "the sentences of a receiver have",
            Format::Rtklib => "a solution of RTKLIB has",
            Format::Description => "a description has those of its files, and",
        };
        let has_topic = matches!(format, Format::Ulog | Format::Nmea | Format::Rtklib);
        match (self.rate, &self.topic) {
            (Some(_), _) => Err(format!("--rate is for a CSV without times, and {name} times; leave it out")),
            (_, Some(topic)) if !has_topic => {
                Err(format!("topic={topic} names a topic for fixes, and {name} topics of its own; leave it out"))
            }
            _ => Ok(()),
        }
    }

    /// The format, by the first bytes.
    pub(super) fn format(&self) -> Result<Format, String> {
        if self.file == Path::new("-") || !self.columns.is_empty() {
            return Ok(Format::Csv);
        }
        if self.file.extension().is_some_and(|extension| extension == "toml") {
            return Ok(Format::Description);
        }
        let mut start = [0; 16];
        let mut length = 0;
        let mut opened = File::open(&self.file).map_err(|error| format!("cannot be read: {error}"))?;
        while length < start.len() {
            match opened.read(&mut start[length..]) {
                Ok(0) => break,
                Ok(count) => length += count,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(format!("cannot be read: {error}")),
            }
        }
        let start = start[..length].trim_ascii_start();
        Ok(match start {
            _ if start.starts_with(b"#ROSBAG") => Format::Ros1,
            _ if start.starts_with(b"ULog") => Format::Ulog,
            [b'$', b'A'..=b'Z', ..] => Format::Nmea,
            [b'%', ..] => Format::Rtklib,
            _ => Format::Csv,
        })
    }
}

/// A list of files on one clock.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Description {
    file: Vec<Described>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Described {
    /// Relative to the description.
    path: PathBuf,
    #[serde(default)]
    columns: String,
    rate: Option<f64>,
    topic: Option<String>,
}

/// Reads a description: `[[file]]` with `path`, and for a CSV `columns` and perhaps `rate`.
pub(super) fn described(description: &Path) -> Result<Vec<Input>, String> {
    let text = std::fs::read_to_string(description).map_err(|error| format!("cannot be read: {error}"))?;
    let Description { file: files } = toml::from_str(&text).map_err(|error| error.to_string().trim().to_owned())?;
    let folder = description.parent().unwrap_or(Path::new(""));
    let input = |Described { path, columns, rate, topic }: Described| {
        let in_file = |fault: String| format!("{}: {fault}", path.display());
        let rate = rate.map(super::hertz).transpose().map_err(|fault| in_file(format!("rate: {fault}")))?;
        let mut input = Input { file: folder.join(&path), columns: Vec::new(), rate, topic };
        input.map(&columns).map_err(|fault| in_file(format!("columns: {fault}")))?;
        Ok(input)
    };
    files.into_iter().map(input).collect()
}

/// The entries of a file, in its order.
pub(super) struct Source {
    /// Path of the file, for errors.
    pub(super) file: PathBuf,
    /// Read from a CSV as they are needed.
    table: Option<Table>,
    waiting: VecDeque<Entry>,
    /// Remarks for the output.
    pub(super) notes: Vec<String>,
}

impl Source {
    /// Opens a file of any format but bags.
    pub(super) fn open(input: &Input, format: Format) -> Result<Self, String> {
        let mut source =
            Self { file: input.file.clone(), table: None, waiting: VecDeque::new(), notes: Vec::new() };
        let topic = input.topic.as_deref();
        match format {
            Format::Nmea => {
                let (entries, bad) = nmea::read(&input.file, topic)?;
                source.waiting = entries.into();
                if bad > 0 {
                    let lines = if bad == 1 { "1 line is".to_owned() } else { format!("{bad} lines are") };
                    source.notes.push(format!("{lines} no sentence with the right checksum"));
                }
            }
            Format::Rtklib => source.waiting = rtklib::read(&input.file, topic)?.into(),
            Format::Ulog => {
                let (entries, broken) = ulog::read(&input.file, topic)?;
                source.waiting = entries.into();
                source.notes.extend(broken.map(|broken| format!("not read to its end: {broken}")));
            }
            Format::Description => return Err("a description does not name another".into()),
            Format::Csv | Format::Ros1 => {
                if input.columns.is_empty() {
                    return Err(
                        "what its columns contain is not said; name them with --columns, as time=1:ns gyr=2-4 \
                                acc=5-7"
                            .into(),
                    );
                }
                let columns =
                    Columns::new(&input.columns, input.rate).map_err(|fault| format!("columns: {fault}"))?;
                let times = input.rate.map_or(Times::Column, Times::Rate);
                source.table = Some(Table::open(&input.file, &columns, times, topic)?);
            }
        }
        Ok(source)
    }

    /// The time of the next entry.
    pub(super) fn time_ns(&mut self) -> Result<Option<i64>, String> {
        while self.waiting.is_empty()
            && let Some(table) = &mut self.table
        {
            match table.next()? {
                Some(row) => self.waiting.extend(row),
                None => break,
            }
        }
        Ok(self.waiting.front().map(|entry| entry.time_ns))
    }

    pub(super) fn next(&mut self) -> Option<Entry> {
        self.waiting.pop_front()
    }

    /// The length of a file that is read as it is needed.
    pub(super) fn bytes(&self) -> Option<u64> {
        self.table.as_ref()?.bytes()
    }

    /// The current position in it.
    pub(super) fn byte(&self) -> u64 {
        self.table.as_ref().map_or(0, Table::byte)
    }

    /// The number of lines before its first row.
    pub(super) fn head(&self) -> usize {
        self.table.as_ref().map_or(0, Table::head)
    }
}
