//! The help of every command is what is stored. `UPDATE_HELP=1` stores it.

use crate::common::bb;
use std::path::Path;

/// Appends the help of a command, and of those below it.
fn append(words: &[&str], found: &mut String) {
    let output = bb(&[words, &["--help"]].concat());
    assert_eq!(output.code, Some(0), "{words:?}: {}", output.err);
    *found += &format!("$ {}\n{}\n", [&["bb"][..], words, &["--help"]].concat().join(" "), output.out);
    let below = output.out.split("\nCommands:\n").nth(1).and_then(|rest| rest.split("\n\n").next());
    let names = below.unwrap_or_default().lines().filter_map(|line| line.split_whitespace().next());
    names.filter(|name| *name != "help").for_each(|name| append(&[words, &[name]].concat(), found));
}

#[test]
fn help_is_what_is_stored() {
    let mut found = String::new();
    append(&[], &mut found);
    let stored = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bb/help.txt");
    if std::env::var_os("UPDATE_HELP").is_some() {
        std::fs::write(&stored, &found).expect("writes");
    }
    let known = std::fs::read_to_string(stored).expect("is stored");
    assert_eq!(found, known, "read it, then store it with UPDATE_HELP=1");
}
