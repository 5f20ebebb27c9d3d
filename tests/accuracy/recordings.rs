//! Where the recordings are.

use std::io::Write;
use std::path::{Path, PathBuf};

/// How many trials of BROAD the bounds are for.
pub(crate) const TRIALS: usize = 10;

/// How many data sets of navigation there are; one is left out, as it has the samples of another.
pub(crate) const SETS: usize = 7;

/// The bags of `broad`, by name; none, with a line that says so, if there is no data at all.
///
/// # Errors
/// There is data, and not as many bags as the bounds are for.
pub(crate) fn broad() -> Result<Option<Vec<PathBuf>>, String> {
    let Some((folder, files)) = folder(&data(), "broad")? else { return Ok(None) };
    let mut bags: Vec<_> =
        files.into_iter().filter(|file| file.extension().is_some_and(|end| end == "mcap")).collect();
    bags.sort();
    expect(&folder, TRIALS, bags.len())?;
    Ok(Some(bags))
}

/// The folder of `navigation`; none, with a line that says so, if there is no data at all.
///
/// # Errors
/// There is data, and not as many data sets as the bounds are for.
pub(crate) fn navigation() -> Result<Option<PathBuf>, String> {
    let Some((folder, files)) = folder(&data(), "navigation")? else { return Ok(None) };
    let is_set = |file: &&PathBuf| file.to_string_lossy().ends_with("_imu.csv");
    expect(&folder, SETS, files.iter().filter(is_set).count())?;
    Ok(Some(folder))
}

fn data() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data")
}

/// A folder and what is in it.
type Folder = (PathBuf, Vec<PathBuf>);

/// A folder of the data; none if there is no data at all.
fn folder(data: &Path, name: &str) -> Result<Option<Folder>, String> {
    if !data.exists() {
        // To the terminal itself: the test harness keeps what a passing test prints.
        let _ = writeln!(std::io::stderr(), "skipped: no recordings, since there is no ../shared/data");
        return Ok(None);
    }
    let folder = data.join(name);
    let entries = std::fs::read_dir(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let files = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    Ok(Some((folder, files)))
}

fn expect(folder: &Path, expected: usize, found: usize) -> Result<(), String> {
    match found == expected {
        true => Ok(()),
        false => Err(format!(
            "{}: {found} recordings, and the bounds are for {expected}: get all of them",
            folder.display()
        )),
    }
}

#[test]
fn data_that_is_missing_in_part_is_an_error() {
    let nowhere = Path::new(env!("CARGO_TARGET_TMPDIR")).join("no-such-data");
    assert!(matches!(folder(&nowhere, "broad"), Ok(None)), "there is no data, and it may be missing");
    let data = Path::new(env!("CARGO_TARGET_TMPDIR")).join("data-in-part");
    std::fs::create_dir_all(data.join("broad")).expect("there is room");
    assert!(folder(&data, "navigation").is_err());
    let (found, files) = folder(&data, "broad").expect("it is there").expect("there is data");
    let said = expect(&found, TRIALS, files.len()).expect_err("it is empty");
    assert!(said.contains("broad: 0 recordings, and the bounds are for 10"), "{said}");
}
