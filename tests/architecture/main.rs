//! Claims of ARCHITECTURE.md: its paths exist, dependencies of crates, folders and files point one way, the public items of the runtime
//! are those that users need, and doc comments open with a phrase.

mod circles;
mod comments;
mod crates;
mod documents;
mod layers;
mod modules;
mod surface;

use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

fn read(file: &str) -> String {
    std::fs::read_to_string(root().join(file)).unwrap_or_else(|error| panic!("{file}: {error}"))
}

/// The folders of the crates with code that others use.
const CRATES: [&str; 16] = [
    "bb-macros",
    "bb-message",
    "bb-kinematics",
    "bb-core",
    "bb-estimators",
    "bb-eval",
    "bb-cli",
    "integrations/dashboard",
    "integrations/foxglove",
    "integrations/mavlink",
    "integrations/mcap",
    "integrations/metrics",
    "integrations/plot",
    "integrations/redb",
    "integrations/ros2",
    "integrations/zenoh",
];

/// Returns all files of the project below a folder, without those that are built or hidden.
fn project_files(below: &str) -> impl Iterator<Item = PathBuf> {
    let mut folders = vec![root().join(below)];
    let mut files: Vec<PathBuf> = Vec::new();
    std::iter::from_fn(move || {
        while files.is_empty() {
            let folder = folders.pop()?;
            let entries =
                std::fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
            for entry in entries.flatten() {
                let (path, name) = (entry.path(), entry.file_name());
                if !path.is_dir() {
                    files.push(path);
                } else if name != "target" && !name.to_string_lossy().starts_with('.') {
                    folders.push(path);
                }
            }
        }
        files.pop()
    })
}

/// All files of code below a folder, without those of tests.
fn code_below(folder: &Path, files: &mut Vec<PathBuf>) {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let parent = [folder.with_extension("rs"), folder.join("lib.rs")].into_iter().find(|file| file.exists());
    let parent = parent.and_then(|file| std::fs::read_to_string(file).ok()).unwrap_or_default();
    for path in entries.flatten().map(|entry| entry.path()) {
        let name = path.file_stem().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        if is_for_tests(&parent, &name) {
            continue;
        }
        if path.is_dir() {
            code_below(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
}

/// Returns whether a folder's file declares the module for tests alone.
fn is_for_tests(folder: &str, module: &str) -> bool {
    let declaration = format!(" mod {module};");
    let lines: Vec<&str> = folder.lines().collect();
    let Some(at) = lines.iter().position(|line| format!(" {line}").ends_with(&declaration)) else { return false };
    let attributes = lines[..at].iter().rev().take_while(|line| line.starts_with("#["));
    attributes.into_iter().any(|line| line.starts_with("#[cfg(") && line.contains("test"))
}

/// The code of a file without its tests and comments.
fn code_of(file: &Path) -> String {
    let text = std::fs::read_to_string(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    // Tests in the file are its end.
    let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or("");
    let code: Vec<&str> = text.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
    code.join("\n")
}
