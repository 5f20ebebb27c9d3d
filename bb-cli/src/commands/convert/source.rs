//! A CSV being read, once from beginning to end, so that it may be a pipe.

use csv::{ReaderBuilder, StringRecord, Terminator};
use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Read};
use std::path::Path;

/// The largest number of lines before the first numeric one.
pub(super) const LONGEST_HEAD: usize = 100;
/// The number of bytes searched for it, if a file has no lines.
const LONGEST_START: u64 = 1 << 20;

/// The lines of a CSV as cells.
pub(super) struct Source {
    reader: csv::Reader<Box<dyn Read>>,
    /// `true` if any number of spaces separates cells, so that none is empty.
    has_spaces: bool,
    bytes: Option<u64>,
}

impl Source {
    /// Opens a file, or the standard input for `-`.
    pub(super) fn open(file: &Path) -> Result<Self, String> {
        let failed = |error: std::io::Error| format!("cannot be read: {error}");
        let (mut input, bytes): (Box<dyn BufRead>, _) = match file == Path::new("-") {
            true => (Box::new(BufReader::new(std::io::stdin())), None),
            false => {
                let opened = File::open(file).map_err(failed)?;
                let about = opened.metadata().map_err(failed)?;
                (Box::new(BufReader::new(opened)), Some(about.len()).filter(|_| about.is_file()))
            }
        };
        let (start, delimiter) = start(&mut input).map_err(failed)?;
        // The last line may lack a line end, and the line of a record is counted by line ends.
        let whole = Cursor::new(start).chain(input).chain(&b"\n"[..]);
        let reader = ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .trim(csv::Trim::All)
            .delimiter(delimiter)
            // A carriage return before it is trimmed.
            .terminator(Terminator::Any(b'\n'))
            .from_reader(Box::new(whole) as Box<dyn Read>);
        Ok(Self { reader, has_spaces: delimiter == b' ', bytes })
    }

    /// The length, if it is a regular file.
    pub(super) fn bytes(&self) -> Option<u64> {
        self.bytes
    }

    /// The current position in the file.
    pub(super) fn byte(&self) -> u64 {
        self.reader.position().byte()
    }

    /// The next line that is not empty, and its number.
    pub(super) fn next(&mut self) -> Result<Option<(u64, StringRecord)>, String> {
        let mut record = StringRecord::new();
        while self.reader.read_record(&mut record).map_err(said)? {
            if record.iter().any(|cell| !cell.is_empty()) || record.len() > 1 {
                let within: usize = record.iter().map(|cell| cell.matches('\n').count()).sum();
                let line = self.reader.position().line().saturating_sub(1 + within as u64);
                if self.has_spaces {
                    record = record.iter().filter(|cell| !cell.is_empty()).collect();
                }
                return Ok(Some((line, record)));
            }
        }
        Ok(None)
    }
}

fn said(error: csv::Error) -> String {
    match error.kind() {
        csv::ErrorKind::Utf8 { pos: Some(place), .. } => format!("line {} is not UTF-8", place.line()),
        csv::ErrorKind::Io(cause) => format!("cannot be read: {cause}"),
        _ => error.to_string(),
    }
}

/// Returns whether a cell is a number, possibly with a decimal comma.
pub(super) fn is_number(cell: &str) -> bool {
    cell.replace(',', ".").parse::<f64>().is_ok()
}

/// Reads up to the first line that begins with a number. The delimiter comes from that line, since a header may
/// contain others in its words.
fn start(input: &mut dyn BufRead) -> std::io::Result<(Vec<u8>, u8)> {
    let mut input = input.take(LONGEST_START);
    let mut start = Vec::new();
    let mut delimiters = Vec::new();
    for _ in 0..=LONGEST_HEAD {
        let before = start.len();
        if input.read_until(b'\n', &mut start)? == 0 {
            break;
        }
        let line = String::from_utf8_lossy(&start[before..]);
        let delimiter = delimiter(&line);
        let first = line.trim_start_matches('\u{feff}').trim_start().split(delimiter).next().unwrap_or("");
        if is_number(first.trim().trim_matches('"').trim()) {
            return Ok((start, delimiter as u8));
        }
        delimiters.push(delimiter);
    }
    // The header will be reported in an error.
    Ok((start, delimiters.first().map_or(b',', |delimiter| *delimiter as u8)))
}

/// Returns the delimiter of a line. With tabs or semicolons, commas belong to its numbers; spaces may follow a comma.
fn delimiter(line: &str) -> char {
    let has = |delimiter: &char| line.trim().contains(*delimiter);
    ['\t', ';', ',', ' '].into_iter().find(has).unwrap_or(',')
}

/// A decimal number with a unit as nanoseconds, rounded down, without conversion to a float; `None` if the number or
/// the unit is not decimal.
pub(super) fn exact_ns(cell: &str, factor: f64) -> Option<i64> {
    let units = [(1.0, 9), (1e-3, 6), (1e-6, 3), (1e-9, 0)];
    let (_, digits) = units.into_iter().find(|(unit, _)| *unit == factor)?;
    let (whole, part) = cell.split_once('.').unwrap_or((cell, ""));
    let is_negative = whole.starts_with('-');
    let whole: i64 = whole.parse().ok()?;
    if !part.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    let kept = &part[..part.len().min(digits)];
    let scale = |digits: usize| 10_i64.checked_pow(u32::try_from(digits).ok()?);
    let part =
        if kept.is_empty() { 0 } else { kept.parse::<i64>().ok()?.checked_mul(scale(digits - kept.len())?)? };
    whole.checked_mul(scale(digits)?)?.checked_add(if is_negative { -part } else { part })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> u8 {
        start(&mut text.as_bytes()).expect("reads").1
    }

    #[test]
    fn the_delimiter_is_that_of_the_first_line_of_numbers() {
        assert_eq!(of("t,x\n0,1\n"), b',');
        assert_eq!(of("# logged by me; at noon; with a chip\nt,x\n0,1\n"), b',');
        assert_eq!(of("# x, y, z, and so on, and on\n0;1\n"), b';');
        assert_eq!(of("t;x\n0,5;1,5\n"), b';');
        assert_eq!(of("\u{feff}\"0\"\t1\r\n"), b'\t');
        assert_eq!(of("t x\n  0.5  -1e-3\n"), b' ');
        assert_eq!(of("0, 1\n"), b',');
        assert_eq!(of("a;b;c"), b';');
        assert_eq!(of(""), b',');
    }

    #[test]
    fn times_keep_their_nanoseconds() {
        assert_eq!(exact_ns("1403636579758555392", 1e-9), Some(1_403_636_579_758_555_392));
        assert_eq!(exact_ns("1403636579.758555392", 1.0), Some(1_403_636_579_758_555_392));
        assert_eq!(exact_ns("1403636579758555.392", 1e-6), Some(1_403_636_579_758_555_392));
        assert_eq!(exact_ns("12", 1e-3), Some(12_000_000));
        assert_eq!(exact_ns("-0.25", 1.0), Some(-250_000_000));
        assert_eq!(exact_ns("0.01", 1.0), Some(10_000_000));
        // Digits beyond the nanosecond.
        assert_eq!(exact_ns("1.0000000019", 1.0), Some(1_000_000_001));
        assert_eq!(exact_ns("1e-3", 1.0), None);
        assert_eq!(exact_ns("1.-3", 1.0), None);
        assert_eq!(exact_ns("99999999999999999999", 1.0), None);
    }
}
