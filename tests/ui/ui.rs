//! Robots that must not compile: `<rule>/wrong_*.rs` with what rustc says. Those that must compile are in `right.rs`.

use std::fs;
use std::path::Path;

#[test]
fn robots() {
    let cases = trybuild::TestCases::new();
    cases.compile_fail("*/wrong_*.rs");
}

/// The guide explains errors of rustc that the language cannot answer: each is one that a robot here gets.
#[test]
fn errors_in_the_guide_are_pinned_here() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let guide = fs::read_to_string(folder.join("../../book/src/how-to/components.md")).expect("it is there");
    let rows: Vec<&str> = guide.lines().filter(|line| line.starts_with("| E0")).collect();
    assert!(rows.len() > 4, "{rows:#?}");
    let pinned = pinned(folder);
    for code in rows.iter().filter_map(|row| row.split('|').nth(1)).flat_map(|cell| cell.split([' ', ','])) {
        let is_code = code.len() == 5 && code.starts_with("E0");
        assert!(!is_code || pinned.contains(&format!("error[{code}]")), "{code}");
    }
}

/// All that rustc says of the robots here.
fn pinned(folder: &Path) -> String {
    let mut text = String::new();
    for entry in fs::read_dir(folder).expect("it is a folder").map(|entry| entry.expect("it can be read").path()) {
        if entry.is_dir() {
            text += &pinned(&entry);
        } else if entry.extension().is_some_and(|extension| extension == "stderr") {
            text += &fs::read_to_string(&entry).expect("it can be read");
        }
    }
    text
}
