//! Recordings of real sensors, which are not part of the repository: the variable `BB_DATA` names their folder, and
//! `CONTRIBUTING.md` their sources. Tests that need them are ignored by default, and fail without them.

use std::path::{Path, PathBuf};

/// Number of trials of BROAD that the bounds are for.
pub const TRIALS: usize = 10;

/// Number of recordings of phones.
pub const PHONES: usize = 66;

/// Number of bags of vehicles.
pub const VEHICLES: usize = 7;

/// Number of data sets of navigation; one is left out, as it has the samples of another.
pub const SETS: usize = 7;

/// The trials of BROAD, by name.
///
/// # Errors
/// `BB_DATA` is not set, or the folder has not as many bags as the bounds are for.
pub fn broad() -> Result<Vec<PathBuf>, String> {
    broad_in(std::env::var_os("BB_DATA").map(PathBuf::from).as_deref())
}

/// The folder of all recordings that the families of attitude filters are made of.
///
/// # Errors
/// `BB_DATA` is not set, or the folder has not as many recordings as the bounds are for.
pub fn families() -> Result<PathBuf, String> {
    let data = std::env::var_os("BB_DATA").map(PathBuf::from);
    broad_in(data.as_deref())?;
    navigation_in(data.as_deref())?;
    let (phones, files) = folder(data.as_deref(), "phones")?;
    expect(&phones, PHONES, files.len())?;
    Ok(data.unwrap_or_default())
}

/// The folder of the data sets of navigation.
///
/// # Errors
/// `BB_DATA` is not set, or the folder has not as many data sets as the bounds are for.
pub fn navigation() -> Result<PathBuf, String> {
    navigation_in(std::env::var_os("BB_DATA").map(PathBuf::from).as_deref())
}

/// The folder of the bags of vehicles.
///
/// # Errors
/// `BB_DATA` is not set, or the folder has not as many bags as the bounds are for.
pub fn vehicles() -> Result<PathBuf, String> {
    let (folder, files) = folder(std::env::var_os("BB_DATA").map(PathBuf::from).as_deref(), "vehicles")?;
    expect(&folder, VEHICLES, files.len())?;
    Ok(folder)
}

fn broad_in(data: Option<&Path>) -> Result<Vec<PathBuf>, String> {
    let (folder, files) = folder(data, "broad")?;
    let mut bags: Vec<_> =
        files.into_iter().filter(|file| file.extension().is_some_and(|end| end == "mcap")).collect();
    bags.sort();
    expect(&folder, TRIALS, bags.len())?;
    Ok(bags)
}

fn navigation_in(data: Option<&Path>) -> Result<PathBuf, String> {
    let (folder, files) = folder(data, "navigation")?;
    let is_set = |file: &&PathBuf| file.to_string_lossy().ends_with("_imu.csv");
    expect(&folder, SETS, files.iter().filter(is_set).count())?;
    Ok(folder)
}

/// A folder of the data, and what is in it.
fn folder(data: Option<&Path>, name: &str) -> Result<(PathBuf, Vec<PathBuf>), String> {
    let data = data.ok_or("BB_DATA is not set; set it to the folder of the recordings, see CONTRIBUTING.md")?;
    let folder = data.join(name);
    let entries = std::fs::read_dir(&folder).map_err(|error| format!("BB_DATA: {}: {error}", folder.display()))?;
    let files = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    Ok((folder, files))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_recordings_are_an_error() {
        let unset = broad_in(None).expect_err("there is no folder");
        assert!(unset.starts_with("BB_DATA is not set"), "{unset}");
        let data = std::env::temp_dir().join(format!("bb-data-in-part-{}", std::process::id()));
        std::fs::create_dir_all(data.join("broad")).expect("there is room");
        assert!(navigation_in(Some(&data)).is_err(), "it has no such folder");
        let empty = broad_in(Some(&data)).expect_err("it is empty");
        assert!(empty.contains("broad: 0 recordings, and the bounds are for 10"), "{empty}");
        std::fs::remove_dir_all(&data).expect("it was made");
    }
}
