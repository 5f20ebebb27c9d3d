//! Paths and names in the documents: all of them exist.

use super::{CRATES, project_files, read, root};
use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};

#[test]
fn paths_in_the_documents_exist() {
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

/// The pictures name files below one folder, which the text before them names.
#[test]
fn paths_in_the_pictures_exist() {
    let text = read("ARCHITECTURE.md");
    let labels = text.split("<br/>").skip(1).filter_map(|rest| rest.split(['"', '<']).next());
    let mut checked = 0;
    for path in labels.filter(|label| label.ends_with(".rs")) {
        assert!(root().join("bb-core/src").join(path).exists(), "a picture names {path}, which is not there");
        checked += 1;
    }
    assert!(checked > 15, "{checked}");
}

/// The pages of the book by path, without the table of contents.
fn pages() -> Vec<PathBuf> {
    let is_page = |path: &PathBuf| path.extension().is_some_and(|end| end == "md") && !path.ends_with("SUMMARY.md");
    let mut pages: Vec<PathBuf> = project_files("book/src").filter(is_page).collect();
    pages.sort();
    pages
}

/// The lines outside of blocks of code.
fn prose(text: &str) -> impl Iterator<Item = &str> {
    let mut is_code = false;
    text.lines().filter(move |line| {
        let is_fence = line.starts_with("```");
        is_code ^= is_fence;
        !is_code && !is_fence
    })
}

/// The targets of a document's links to other files and places, `path#anchor`, either part of which may be empty.
fn links(text: &str) -> Vec<&str> {
    prose(text)
        .flat_map(|line| line.split("](").skip(1))
        .filter_map(|rest| rest.split(')').next())
        .filter(|target| !target.contains(':'))
        .collect()
}

/// The anchors that mdBook and GitHub give to a document's headings.
fn anchors(text: &str) -> BTreeSet<String> {
    let mut anchors = BTreeSet::new();
    for title in prose(text).filter(|line| line.starts_with('#')).map(|line| line.trim_start_matches('#').trim()) {
        let kept = title.chars().filter(|letter| letter.is_alphanumeric() || " -_".contains(*letter));
        let anchor: String = kept.collect::<String>().to_lowercase().replace(' ', "-");
        let again = (1..).map(|count| format!("{anchor}-{count}"));
        let free = std::iter::once(anchor.clone()).chain(again).find(|anchor| !anchors.contains(anchor));
        anchors.extend(free);
    }
    anchors
}

/// A path without `..`, so that two of one file are equal.
fn plain(path: &Path) -> PathBuf {
    path.components().fold(PathBuf::new(), |mut plain, part| {
        if part == Component::ParentDir && plain.file_name().is_some() {
            plain.pop();
        } else {
            plain.push(part);
        }
        plain
    })
}

#[test]
fn summary_names_each_page_of_the_book_once() {
    let summary = read("book/src/SUMMARY.md");
    let mut named: Vec<PathBuf> = links(&summary).iter().map(|link| root().join("book/src").join(link)).collect();
    named.sort();
    assert_eq!(named, pages());
}

#[test]
fn chapters_of_the_tutorial_are_short() {
    let chapters =
        pages().into_iter().filter(|page| page.parent().is_some_and(|folder| folder.ends_with("tutorial")));
    let lengths: Vec<usize> =
        chapters.map(|page| std::fs::read_to_string(page).expect("it is there").lines().count()).collect();
    assert!(lengths.len() == 6 && lengths.iter().all(|length| *length <= 150), "{lengths:?}");
    assert!(read("README.md").lines().count() <= 150);
}

#[test]
fn every_link_leads_to_a_place() {
    let documents = ["ARCHITECTURE.md", "CONTRIBUTING.md", "README.md"].map(|document| root().join(document));
    let mut checked = 0;
    for document in pages().into_iter().chain(documents) {
        let text = std::fs::read_to_string(&document).expect("it is there");
        for link in links(&text) {
            let (path, anchor) = link.split_once('#').unwrap_or((link, ""));
            let folder = document.parent().expect("it is in a folder");
            let target = if path.is_empty() { document.clone() } else { plain(&folder.join(path)) };
            let name = document.display();
            let there = std::fs::read(&target).unwrap_or_else(|error| panic!("{name} links to {link}: {error}"));
            assert!(
                anchor.is_empty() || anchors(&String::from_utf8_lossy(&there)).contains(anchor),
                "{name} links to {link}, where no heading is called so"
            );
            checked += 1;
        }
    }
    assert!(checked > 100, "{checked}");
}

#[test]
fn code_of_the_book_is_compiled() {
    let compiled = read("tests/src/lib.rs");
    for page in pages() {
        let text = std::fs::read_to_string(&page).expect("it is there");
        let is_code = |line: &str| line.starts_with("```rust") && !line.contains("ignore");
        let name = plain(&page).strip_prefix(plain(root())).expect("it is in the project").display().to_string();
        assert!(
            !text.lines().any(is_code) || compiled.contains(&format!("\"{name}\"")),
            "tests/src/lib.rs does not name {name}"
        );
    }
}

/// A line of code without its indentation, and without marks of doc comments.
fn quoted(line: &str) -> &str {
    let line = line.trim();
    ["///", "//!"].iter().find_map(|mark| line.strip_prefix(mark)).map_or(line, quoted)
}

/// A fragment after a line that ends with a link to a file, `[robot.rs](../robot.rs):`, is quoted from it; a line `// …` leaves some out.
#[test]
fn fragments_are_quoted_from_the_files_before_them() {
    let mut checked = 0;
    for page in pages() {
        let text = std::fs::read_to_string(&page).expect("it is there");
        let lines: Vec<&str> = text.lines().collect();
        for start in (2..lines.len()).filter(|line| lines[*line].starts_with("```rust,ignore")) {
            let link = lines[start - 2].strip_suffix("):").and_then(|line| line.rsplit_once("]("));
            let Some((_, link)) = link.filter(|(_, link)| link.ends_with(".rs")) else { continue };
            let file = plain(&page.parent().expect("it is in a folder").join(link));
            let source =
                std::fs::read_to_string(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
            let source: String = source.lines().map(|line| format!("{}\n", quoted(line))).collect();
            let mut rest = &*source;
            let block: Vec<&str> =
                lines[start + 1..].iter().map_while(|line| (*line != "```").then(|| quoted(line))).collect();
            for part in block.split(|line| *line == "// …") {
                let part: String = part.iter().map(|line| format!("{line}\n")).collect();
                let Some(at) = rest.find(&part) else {
                    panic!("{} quotes what {link} has not:\n{part}", page.display())
                };
                rest = &rest[at + part.len()..];
            }
            checked += 1;
        }
    }
    assert!(checked > 5, "{checked}");
}

/// Recordings come through `BB_DATA`, and nothing else is looked for outside the checkout.
#[test]
fn nothing_beside_the_project_is_named() {
    let (mut read, mut found) = (0, Vec::new());
    for path in project_files("") {
        let is_text =
            path.extension().is_none_or(|end| ["md", "rs", "py", "toml", "txt"].iter().any(|text| end == *text));
        let Ok(text) = std::fs::read_to_string(&path) else { continue };
        read += usize::from(is_text);
        if is_text && text.contains(concat!("../", "shared")) {
            found.push(path);
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
