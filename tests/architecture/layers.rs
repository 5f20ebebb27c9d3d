//! Folders that are layers import only from below.

use super::{code_below, code_of, root};
use std::collections::BTreeSet;

/// The folders of the runtime, from the bottom up.
const LAYERS: [&str; 18] = [
    "fault",
    "time",
    "message",
    "payload",
    "pubsub",
    "topology",
    "kinematics",
    "joints",
    "event",
    "declaration",
    "journal",
    "telemetry",
    "schedule",
    "component",
    "lifecycle",
    "node",
    "control",
    "run",
];

/// The first names of all paths that begin with `crate::`, also of those in a group.
fn named_in_crate(code: &str) -> Vec<&str> {
    let name = |text: &str| text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').count();
    let mut names = Vec::new();
    for (at, start) in code.match_indices("crate::") {
        // `$crate` is what a macro's user sees; `my_crate::` is another crate.
        if code[..at].ends_with(|c: char| c == '$' || c == '_' || c.is_alphanumeric()) {
            continue;
        }
        let rest = &code[at + start.len()..];
        let Some(group) = rest.strip_prefix('{') else {
            names.push(&rest[..name(rest)]);
            continue;
        };
        let mut depth = 1;
        let mut begins = true;
        for (index, c) in group.char_indices() {
            match c {
                '{' => depth += 1,
                '}' if depth == 1 => break,
                '}' => depth -= 1,
                ',' if depth == 1 => begins = true,
                c if depth == 1 && begins && c.is_alphabetic() => {
                    names.push(&group[index..index + name(&group[index..])]);
                    begins = false;
                }
                _ => {}
            }
        }
    }
    names
}

#[test]
fn names_are_found_in_paths_and_groups() {
    let code = "use crate::a::{b, c};\nuse crate::{d::{e, f}, g};\ncrate::h::i(); $crate::j; my_crate::k;";
    assert_eq!(named_in_crate(code), ["a", "d", "g", "h"]);
}

#[test]
fn folders_of_the_runtime_import_only_from_below() {
    let source = root().join("bb-core/src");
    let mut files = Vec::new();
    code_below(&source, &mut files);
    let mut upward = Vec::new();
    let mut seen = BTreeSet::new();
    for file in files {
        let inside = file.strip_prefix(&source).expect("it is below").to_string_lossy().into_owned();
        let folder = inside.split('/').next().unwrap_or("").trim_end_matches(".rs").to_owned();
        let Some(layer) = LAYERS.iter().position(|name| *name == folder) else {
            // What the expansion names: the crate's own list, and the checks at compile time.
            assert!(["lib", "check", "stub"].contains(&folder.as_str()), "{folder} has no layer");
            continue;
        };
        seen.insert(layer);
        let text = std::fs::read_to_string(&file).unwrap_or_else(|error| panic!("{inside}: {error}"));
        let text = text.split("#[cfg(test)]\nmod ").next().unwrap_or("");
        let text = text.split("#[cfg(all(test").next().unwrap_or("");
        let code: Vec<&str> = text.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
        for name in named_in_crate(&code.join("\n")) {
            // The derive, which bears the name of its trait, is the macros' crate's.
            let is_below = LAYERS.iter().position(|other| *other == name).is_some_and(|other| other <= layer);
            if !is_below && name != "Payload" {
                upward.push(format!("{inside} names crate::{name}"));
            }
        }
    }
    assert_eq!(seen.len(), LAYERS.len(), "every layer is there");
    assert!(upward.is_empty(), "{upward:#?}");
}

/// The modules of the algorithms, from the bottom up.
const ALGORITHMS: [&str; 7] =
    ["params", "moments", "attitude", "navigation", "calibration", "motion", "simulation"];

#[test]
fn algorithms_import_only_from_below() {
    let source = root().join("bb-estimators/src");
    let mut files = Vec::new();
    code_below(&source, &mut files);
    let mut upward = Vec::new();
    for file in files {
        let inside = file.strip_prefix(&source).expect("it is below").to_string_lossy().into_owned();
        let folder = inside.split('/').next().unwrap_or("").trim_end_matches(".rs").to_owned();
        let Some(layer) = ALGORITHMS.iter().position(|name| *name == folder) else {
            assert_eq!(folder, "lib", "{folder} has no layer");
            continue;
        };
        for name in named_in_crate(&code_of(&file)) {
            let is_below = ALGORITHMS.iter().position(|other| *other == name).is_some_and(|other| other <= layer);
            // The list of filters is a macro at the top of the crate.
            if !is_below && name != "attitude_filters" {
                upward.push(format!("{inside} names crate::{name}"));
            }
        }
    }
    assert!(upward.is_empty(), "{upward:#?}");
}
