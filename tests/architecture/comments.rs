//! Doc comments make sense where an editor shows their first line alone.

use super::{project_files, root};
use std::collections::BTreeMap;

/// First words of questions and of fragments that need the code around them. tokio opens none of its doc comments with most of these
/// words, and few with the others; those that it uses freely, such as `If` and `This`, are not here.
const FRAGMENTS: &[&str] = &[
    "And", "As", "At", "But", "By", "For", "From", "How", "In", "It", "Its", "Of", "On", "Once", "Or", "So",
    "That", "Their", "These", "They", "Those", "To", "Until", "What", "When", "Where", "Whether", "Which", "Who",
    "Whoever", "Whose", "Why", "With", "The same",
];

/// Folders with such comments: they are yet to be rewritten.
const NOT_YET: &[&str] = &[];

/// Returns the first lines of the doc comments of a file, each with its line number.
fn openings(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let kind = |line: &str| ["///", "//!"].into_iter().find(|mark| line.trim_start().starts_with(mark));
    let mut before = None;
    text.lines().enumerate().filter_map(move |(index, line)| {
        let mark = kind(line);
        let last = std::mem::replace(&mut before, mark);
        (mark.is_some() && mark != last)
            .then(|| (index + 1, line.trim_start().trim_start_matches(['/', '!']).trim()))
    })
}

fn is_fragment(opening: &str) -> bool {
    FRAGMENTS.iter().any(|words| {
        let rest = opening.strip_prefix(words);
        rest.is_some_and(|rest| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '-' || c == '_'))
    })
}

#[test]
fn doc_comments_open_with_a_phrase() {
    assert!(["Its name.", "Whether it runs.", "The same, later."].into_iter().all(is_fragment));
    assert!(
        !["Italic.", "On-line mean.", "The sameness.", "Name.", "`true` if it runs."].into_iter().any(is_fragment)
    );
    let text = "//! Module.\n\n/// Function\n/// of it.\nfn one() {}\n    /// Another.\n";
    assert_eq!(openings(text).collect::<Vec<_>>(), [(1, "Module."), (3, "Function"), (6, "Another.")]);
    let (mut read, mut found) = (0, Vec::new());
    let mut left: BTreeMap<&str, usize> = NOT_YET.iter().map(|folder| (*folder, 0)).collect();
    for path in project_files("").filter(|path| path.extension().is_some_and(|end| end == "rs")) {
        let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let file = path.strip_prefix(root()).expect("it is in the project").to_owned();
        for (line, opening) in openings(&text) {
            read += 1;
            if !is_fragment(opening) {
                continue;
            }
            match left.iter_mut().find(|(folder, _)| file.starts_with(folder)) {
                Some((_, count)) => *count += 1,
                None => found.push(format!("{}:{line}: {opening}", file.display())),
            }
        }
    }
    assert!(read > 10_000, "only {read} doc comments were read");
    assert!(found.is_empty(), "open these with a noun, or for a function with a verb:\n{}", found.join("\n"));
    let clean: Vec<&str> = left.into_iter().filter(|(_, count)| *count == 0).map(|(folder, _)| folder).collect();
    assert!(clean.is_empty(), "these folders are clean; remove them from the list: {clean:?}");
}
