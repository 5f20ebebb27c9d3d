//! Where the recordings are.

use std::io::Write;
use std::path::{Path, PathBuf};

/// The bags of `broad`, by name; none, with a line that says so, if they are not there.
pub(crate) fn broad() -> Option<Vec<PathBuf>> {
    let (_, files) = folder("broad")?;
    let mut bags: Vec<_> =
        files.into_iter().filter(|file| file.extension().is_some_and(|end| end == "mcap")).collect();
    bags.sort();
    Some(bags)
}

/// The folder of `navigation` and the names of the data sets in it; none, with a line that says so, if it is not there.
pub(crate) fn navigation() -> Option<(PathBuf, Vec<String>)> {
    let (folder, files) = folder("navigation")?;
    let name = |file: &PathBuf| Some(file.file_name()?.to_str()?.strip_suffix("_imu.csv")?.to_owned());
    let mut names: Vec<_> = files.iter().filter_map(name).collect();
    names.sort();
    Some((folder, names))
}

/// A folder of the data and what is in it.
fn folder(name: &str) -> Option<(PathBuf, Vec<PathBuf>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data").join(name);
    let entries = match std::fs::read_dir(&folder) {
        Ok(entries) => entries,
        Err(error) => {
            // To the terminal itself: the test harness keeps what a passing test prints.
            let _ = writeln!(std::io::stderr(), "skipped: no recordings in ../shared/data/{name} ({error})");
            return None;
        }
    };
    let files = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    Some((folder, files))
}
