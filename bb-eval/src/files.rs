//! The recordings that paths name.

use bb_estimators::params::nearest;
use bb_mcap::{Bag, RecordingError, RecordingErrorKind};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// The extension of recordings.
pub const EXTENSION: &str = "mcap";

/// The description that ROS 2 writes beside the files of a bag.
const METADATA: &str = "metadata.yaml";

/// Extensions of recordings that cannot be read, or only with another feature. They are also collected from folders,
/// so that an error says for each what to do.
const OTHERS: [&str; 6] = [".db3", ".bag", ".mcap.zstd", ".mcap.zst", ".db3.zstd", ".mcap.gz"];

/// The recordings in the order of the arguments, with those of a folder sorted by name; or the reason why a path has
/// none.
pub fn recordings(paths: &[PathBuf]) -> Vec<(PathBuf, Result<(), String>)> {
    let mut recordings = Vec::new();
    for path in paths {
        let path = &folder_of(path);
        if !path.is_dir() {
            recordings.push((path.clone(), Ok(())));
            continue;
        }
        let mut found = Vec::new();
        match collect(path, &mut found) {
            Err(error) => recordings.push((path.clone(), Err(format!("the folder cannot be read: {error}")))),
            Ok(()) if found.is_empty() => {
                let fault = "the folder holds no file that ends in .mcap; name the recordings or their folder";
                recordings.push((path.clone(), Err(fault.into())));
            }
            Ok(()) => recordings.extend(found.into_iter().map(|file| (file, Ok(())))),
        }
    }
    recordings
}

/// The folder of a bag, if its description is named, or the path itself.
fn folder_of(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|_| path.file_name().is_some_and(|name| name == METADATA) && path.is_file());
    match folder {
        Some(folder) if folder.as_os_str().is_empty() => PathBuf::from("."),
        Some(folder) => folder.to_owned(),
        None => path.to_owned(),
    }
}

/// The recording of a path that names one: a file, the folder of a bag, or the description in it.
///
/// # Errors
/// There is none in the folder, or several; in words.
pub fn recording(path: &Path) -> Result<PathBuf, String> {
    let mut found = recordings(&[path.to_owned()]);
    match found.pop() {
        Some((file, there)) if found.is_empty() => there.map(|()| file),
        _ => Err(format!("{}: the folder holds several recordings; name one of them", path.display())),
    }
}

/// Searches subfolders as well, since a ROS 2 recording is a folder. Links to folders are not followed, as they may be
/// circular.
fn collect(folder: &Path, found: &mut Vec<PathBuf>) -> io::Result<()> {
    let mut entries: Vec<_> = fs::read_dir(folder)?.collect::<Result<_, _>>()?;
    entries.sort_by_key(fs::DirEntry::file_name);
    for entry in entries {
        let path = entry.path();
        if entry.file_type()?.is_dir() {
            collect(&path, found)?;
        } else if is_recording(&path) {
            found.push(path);
        }
    }
    Ok(())
}

fn is_recording(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.extension().is_some_and(|end| end == EXTENSION) || OTHERS.iter().any(|end| name.ends_with(end))
}

/// The error, with the option that chooses another topic. If no topic has the name, the error suggests the nearest one of a
/// `fitting` type, and lists all of these.
pub(crate) fn said(bag: &Bag, fitting: &[&str], error: &RecordingError, option: &str) -> String {
    let kind = error.kind();
    let fits = bag.topics().iter().filter(|topic| fitting.contains(&&*topic.schema));
    let (names, listed): (Vec<&str>, Vec<String>) =
        fits.map(|topic| (&*topic.name, format!("{} ({})", topic.name, topic.schema))).unzip();
    match kind {
        RecordingErrorKind::NoTopicOfType { .. } => kind.to_string(),
        RecordingErrorKind::NoTopic { topic, .. } if !names.is_empty() => {
            let near = nearest(topic, names).map(|near| format!(" did you mean `{near}`?")).unwrap_or_default();
            let there = if listed.len() == 1 { "there is only" } else { "there are" };
            format!("no topic {topic} ({option});{near} of a fitting type {there} {}", listed.join(", "))
        }
        _ => format!("{kind} ({option})"),
    }
}
