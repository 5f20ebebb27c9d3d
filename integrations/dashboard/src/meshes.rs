//! The files of the meshes that robots declare, read once, from a folder that the user names.

use axum::body::Bytes;
use bb_core::topology::Geometry;
use bb_core::{Bus, Fault};
use std::collections::BTreeMap;
use std::io::Read as _;
use std::path::{Component, Path, PathBuf};

/// The longest file that is served.
const LONGEST: u64 = 16 * 1024 * 1024;

/// The served files by their names in the declaration. They are read once: no request names a path.
#[derive(Clone, Debug, Default)]
pub(crate) struct Meshes(BTreeMap<&'static str, Bytes>);

impl Meshes {
    /// Reads the meshes of `robots` from `folder`. One that is missing, too long, or not named `.stl` is logged, and marked in
    /// the page.
    ///
    /// # Errors
    /// `folder` is neither empty nor a folder.
    pub(crate) fn read(folder: &str, robots: &[&Bus]) -> Result<Self, Fault> {
        if folder.is_empty() {
            return Ok(Self::default());
        }
        let within = Path::new(folder).canonicalize();
        let within = within.ok().filter(|folder| folder.is_dir()).ok_or_else(|| {
            Fault::new(format!("`meshes` is `{folder}`: expected a folder with the files of meshes"))
        })?;
        let mut read = BTreeMap::new();
        for file in robots.iter().flat_map(|robot| declared(robot)) {
            match contents(&within, file) {
                Ok(bytes) => drop(read.insert(file, bytes)),
                Err(why) => tracing::warn!(file, folder, "a mesh is not shown: {why}"),
            }
        }
        Ok(Self(read))
    }

    /// The file with this number, from 0.
    pub(crate) fn get(&self, number: usize) -> Option<Bytes> {
        self.0.values().nth(number).cloned()
    }

    /// The addresses by the names in the description, as JSON.
    pub(crate) fn addresses(&self) -> serde_json::Value {
        let addresses = self.0.keys().enumerate();
        let entries = addresses.map(|(number, file)| ((*file).to_owned(), format!("/mesh/{number}").into()));
        serde_json::Value::Object(entries.collect())
    }
}

/// The mesh files that the links of a robot declare.
fn declared(robot: &Bus) -> impl Iterator<Item = &'static str> {
    let visuals = robot.description().links.into_iter().flat_map(|link| link.visuals);
    visuals.filter_map(|visual| match visual.geometry {
        Geometry::Mesh { file, .. } => Some(file),
        _ => None,
    })
}

fn contents(folder: &Path, file: &str) -> Result<Bytes, String> {
    if !Path::new(file).extension().is_some_and(|extension| extension.eq_ignore_ascii_case("stl")) {
        return Err("it is not an STL".to_owned());
    }
    let path = found(folder, file).ok_or("it is not in the folder")?;
    let mut bytes = Vec::new();
    let opened = std::fs::File::open(path).map_err(|error| error.to_string())?;
    opened.take(LONGEST + 1).read_to_end(&mut bytes).map_err(|error| error.to_string())?;
    match u64::try_from(bytes.len()) {
        Ok(length) if length <= LONGEST => Ok(bytes.into()),
        _ => Err(format!("it is longer than {} MiB", LONGEST >> 20)),
    }
}

/// The place of a file in the folder: `package://rover/meshes/body.stl` is `meshes/body.stl`, or else `body.stl`. `None` if it is not in the
/// folder, which symbolic links do not extend.
fn found(folder: &Path, file: &str) -> Option<PathBuf> {
    let below = match file.strip_prefix("package://") {
        Some(in_package) => in_package.split_once('/')?.1,
        None => file.strip_prefix("file://").unwrap_or(file),
    };
    let below = Path::new(below);
    let is_plain = below.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    let candidates = [is_plain.then_some(below), below.file_name().map(Path::new)];
    let mut paths = candidates.into_iter().flatten().filter_map(|path| folder.join(path).canonicalize().ok());
    paths.find(|path| path.starts_with(folder) && path.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::error::Error;

    #[test]
    fn only_files_of_the_folder_are_found() -> Result<(), Box<dyn Error>> {
        let root = std::env::temp_dir().join(format!("bb-dashboard-meshes-{}", std::process::id()));
        let folder = root.join("served");
        std::fs::create_dir_all(folder.join("meshes"))?;
        for (name, text) in
            [("served/meshes/body.stl", "body"), ("served/arm.STL", "arm"), ("secret.stl", "secret")]
        {
            std::fs::write(root.join(name), text)?;
        }
        std::fs::write(folder.join("notes.txt"), "notes")?;
        #[cfg(unix)]
        std::os::unix::fs::symlink(root.join("secret.stl"), folder.join("out.stl"))?;
        let folder = folder.canonicalize()?;
        let read = |file: &str| contents(&folder, file).map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
        for (file, text) in [
            ("package://rover/meshes/body.stl", "body"),
            ("package://rover/arm.STL", "arm"),
            ("package://rover/other/arm.STL", "arm"),
            ("file:///home/me/arm.STL", "arm"),
            ("./meshes/body.stl", "body"),
            ("../arm.STL", "arm"),
        ] {
            assert_eq!(read(file), Ok(text.to_owned()), "{file}");
        }
        let missing = Err("it is not in the folder".to_owned());
        for file in
            ["../secret.stl", "package://rover/../secret.stl", "/secret.stl", "out.stl", "body.stl", "meshes.stl"]
        {
            assert_eq!(read(file), missing, "{file}");
        }
        assert_eq!(read("notes.txt"), Err("it is not an STL".to_owned()));
        std::fs::remove_dir_all(root)?;
        Ok(())
    }
}
