//! Where the recordings are.

use std::path::{Path, PathBuf};

/// The bags of `broad`, by name; none, with a line that says so, if they are not there.
pub(crate) fn broad() -> Option<Vec<PathBuf>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/broad");
    let entries = match std::fs::read_dir(&folder) {
        Ok(entries) => entries,
        Err(error) => {
            // To the terminal itself: the test harness keeps what a passing test prints.
            use std::io::Write;
            let _ = writeln!(std::io::stderr(), "skipped: no recordings in ../shared/data/broad ({error})");
            return None;
        }
    };
    let files = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let mut bags: Vec<_> = files.filter(|file| file.extension().is_some_and(|end| end == "mcap")).collect();
    bags.sort();
    Some(bags)
}
