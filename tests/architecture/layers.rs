//! Folders that are layers import only from below.

use super::modules::Modules;
use super::{code_below, code_of, root};
use std::collections::BTreeSet;

/// The folders of the runtime's crates, from the bottom up.
const LAYERS: [(&str, &[&str]); 3] = [
    ("bb-message", &["sorted", "time", "message", "payload", "outputs"]),
    ("bb-kinematics", &["topology", "kinematics", "joints"]),
    (
        "bb-core",
        &[
            "fault",
            "pubsub",
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
        ],
    ),
];

/// Collects the first names of all paths that begin with `crate::`, also of those in a group.
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
    for (krate, layers) in LAYERS {
        let modules = Modules::of(krate);
        let folders: BTreeSet<&str> = modules.paths().filter_map(|path| path.first()).map(String::as_str).collect();
        let mut drawn: BTreeSet<&str> = layers.iter().copied().collect();
        if krate == "bb-core" {
            // What the expansion names: the checks at compile time.
            drawn.extend(["check", "stub"]);
        }
        assert_eq!(folders, drawn, "{krate}");
        let upward = upward_in(&modules, layers);
        assert!(upward.is_empty(), "{krate}: {upward:#?}");
    }
}

/// The imports that lead up, each from where it stands to where what it names is defined. A name that the crate re-exports
/// leads to the module that defines it, and any other of the crate's root, such as its prelude, leads up.
fn upward_in(modules: &Modules, layers: &[&str]) -> Vec<String> {
    let layer = |path: &[String]| layers.iter().position(|name| path.first().is_some_and(|first| first == name));
    let mut upward = Vec::new();
    for (module, home) in modules.imports() {
        let Some(from) = layer(module) else { continue };
        if layer(&home).is_none_or(|to| to > from) {
            upward.push(format!(
                "{} imports from {}",
                module.join("::"),
                ["crate"].map(str::to_owned).into_iter().chain(home).collect::<Vec<_>>().join("::")
            ));
        }
    }
    upward
}

#[test]
fn an_import_that_leads_up_is_found() {
    let files = [
        ("", "pub use message::Stamped;\npub use run::{Live, Report as Shown};\npub mod prelude {}"),
        ("message", "pub struct Stamped;"),
        ("pubsub", "use crate::Stamped;"),
        ("run", "use crate::Stamped;\npub struct Live;\npub struct Report;"),
    ];
    let with = |code| {
        let modules = Modules::from_texts(files.into_iter().chain([("message::codec", code)]));
        upward_in(&modules, &["message", "pubsub", "run"])
    };
    assert!(with("use super::Stamped;\nuse crate::Stamped as Again;").is_empty());
    for code in ["use crate::Live;", "use crate::{Stamped, Shown};", "fn f(_: crate::run::Live) {}"] {
        assert_eq!(with(code), ["message::codec imports from crate::run"], "{code}");
    }
    assert_eq!(with("use crate::prelude::*;"), ["message::codec imports from crate"]);
}

#[test]
fn the_picture_of_the_layers_is_that_of_the_code() {
    let text = std::fs::read_to_string(root().join("ARCHITECTURE.md")).expect("it is there");
    let picture = text.split("## Layers").nth(1).and_then(|rest| rest.split("```").nth(1)).expect("a picture");
    // Two crates may have a layer of one name, so it is read from the label, not from the id.
    let nodes = picture.lines().filter(|line| !line.trim_start().starts_with("subgraph"));
    let labels = nodes.filter_map(|line| line.split("[\"").nth(1));
    let drawn: Vec<&str> = labels.filter_map(|label| label.split(':').next()).collect();
    let layers: Vec<&str> = LAYERS.iter().rev().flat_map(|(_, layers)| layers.iter().rev().copied()).collect();
    assert_eq!(drawn, layers);
}

/// The modules of the algorithms, from the bottom up.
const ALGORITHMS: [&str; 8] =
    ["params", "moments", "attitude", "navigation", "calibration", "motion", "simulation", "declared"];

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
