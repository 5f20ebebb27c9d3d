//! Paths and names in the documents: all of them exist.

use super::{CRATES, read, root};

#[test]
fn every_path_in_the_documents_exists() {
    for document in ["ARCHITECTURE.md", "CONTRIBUTING.md", "README.md"] {
        let text = read(document);
        let quoted = text.split('`').skip(1).step_by(2);
        let linked = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
        let is_path = |word: &&str| {
            let top = word.split('/').next().unwrap_or("");
            word.contains('/') && !word.contains([' ', ':', '<']) && root().join(top).exists()
                || word.ends_with(".md")
        };
        let paths: Vec<&str> =
            quoted.chain(linked).filter_map(|path| path.split('#').next()).filter(is_path).collect();
        assert!(!paths.is_empty() || document == "CONTRIBUTING.md", "{document} names no path");
        for path in paths {
            assert!(root().join(path).exists(), "{document} names {path}, which is not there");
        }
    }
}

/// Recordings come through `BB_DATA`, and nothing else is looked for outside the checkout.
#[test]
fn nothing_beside_the_project_is_named() {
    let mut folders = vec![root().to_owned()];
    let (mut read, mut found) = (0, Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("it is a folder").flatten() {
            let (path, name) = (entry.path(), entry.file_name());
            if path.is_dir() {
                let is_source = name != "target" && !name.to_string_lossy().starts_with('.');
                folders.extend(is_source.then_some(path));
                continue;
            }
            let is_text = path
                .extension()
                .is_none_or(|end| ["md", "rs", "py", "toml", "txt"].iter().any(|text| end == *text));
            let Ok(text) = std::fs::read_to_string(&path) else { continue };
            read += usize::from(is_text);
            if is_text && text.contains(concat!("../", "shared")) {
                found.push(path);
            }
        }
    }
    assert!(read > 500 && found.is_empty(), "{read} files read; beside the project: {found:#?}");
}

#[test]
fn every_folder_of_code_is_on_the_map() {
    let map = read("ARCHITECTURE.md");
    for krate in CRATES {
        let source = root().join(krate).join("src");
        let entries = std::fs::read_dir(&source).unwrap_or_else(|error| panic!("{}: {error}", source.display()));
        for entry in entries.flatten().filter(|entry| entry.path().is_dir()) {
            let folder = format!("{krate}/src/{}", entry.file_name().to_string_lossy());
            // A folder stands on the map itself, or as the file beside it of the same name.
            let is_there = map.contains(&format!("{folder}/")) || map.contains(&format!("{folder}.rs"));
            assert!(is_there, "ARCHITECTURE.md does not name {folder}");
        }
    }
}

#[test]
fn every_rule_has_its_folder_of_robots() {
    let rules = std::fs::read_dir(root().join("bb-macros/src/verify")).expect("it is on the map");
    for rule in rules.flatten() {
        let name = rule.path().file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        let folder = root().join("tests/ui").join(&name);
        let cases = std::fs::read_dir(&folder).unwrap_or_else(|error| panic!("tests/ui/{name}: {error}"));
        let cases: Vec<_> = cases.flatten().map(|case| case.file_name().to_string_lossy().into_owned()).collect();
        let count =
            |start: &str| cases.iter().filter(|case| case.starts_with(start) && case.ends_with(".rs")).count();
        assert!(
            count("wrong_") >= 2 && count("right_") >= 1,
            "tests/ui/{name} needs two wrong robots and a right one"
        );
    }
}

/// The algorithms cannot depend on the macro, and read units where there is no standard library.
#[test]
fn units_of_parameters_are_those_of_the_language() {
    let table = |file: &str| {
        let text = read(file);
        let table = text.split("const UNITS: ").nth(1).and_then(|rest| rest.split("];").next());
        table.unwrap_or_else(|| panic!("{file} has no table")).to_owned()
    };
    let language = table("bb-macros/src/units.rs");
    assert!(language.contains("\"rad\""));
    assert_eq!(language, table("bb-estimators/src/params/units.rs"));
}
