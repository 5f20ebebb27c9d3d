//! What ARCHITECTURE.md claims: every path in it exists, and arrows between crates point one way.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

fn read(file: &str) -> String {
    std::fs::read_to_string(root().join(file)).unwrap_or_else(|error| panic!("{file}: {error}"))
}

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
        let paths: Vec<&str> = quoted.chain(linked).filter(is_path).collect();
        assert!(!paths.is_empty() || document == "CONTRIBUTING.md", "{document} names no path");
        for path in paths {
            assert!(root().join(path).exists(), "{document} names {path}, which is not there");
        }
    }
}

/// The folders of the crates with code that others use.
const CRATES: [&str; 6] =
    ["bb-macros", "bb-core", "bb-estimators", "bb-cli", "integrations/mcap", "integrations/metrics"];

#[test]
fn every_folder_of_code_is_on_the_map() {
    let map = read("ARCHITECTURE.md");
    for krate in CRATES {
        let source = root().join(krate).join("src");
        let entries = std::fs::read_dir(&source).unwrap_or_else(|error| panic!("{}: {error}", source.display()));
        for entry in entries.flatten().filter(|entry| entry.path().is_dir()) {
            let folder = format!("{krate}/src/{}", entry.file_name().to_string_lossy());
            // The map lists a folder itself or the file of the same name beside it.
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

#[test]
fn arrows_between_crates_point_one_way() {
    let depends = |krate: &str, on: &str| {
        let manifest = read(&format!("{krate}/Cargo.toml"));
        let dependencies = manifest.split("[dependencies]").nth(1).unwrap_or("");
        let dependencies = dependencies.split("\n[").next().unwrap_or("");
        dependencies.lines().any(|line| line.starts_with(on))
    };
    assert!(depends("bb-core", "bb-macros"));
    for (krate, on) in [
        ("bb-macros", "bb-core"),
        ("bb-macros", "bb-estimators"),
        ("bb-core", "bb-estimators"),
        ("bb-core", "bb-cli"),
        ("bb-core", "bb-mcap"),
        ("bb-core", "bb-metrics"),
        ("bb-estimators", "bb-macros"),
        ("bb-estimators", "bb-cli"),
        ("bb-estimators", "bb-mcap"),
        ("bb-estimators", "bb-metrics"),
        ("integrations/mcap", "bb-macros"),
        ("integrations/mcap", "bb-estimators"),
        ("integrations/mcap", "bb-metrics"),
        ("integrations/mcap", "bb-cli"),
        ("integrations/metrics", "bb-macros"),
        ("integrations/metrics", "bb-estimators"),
        ("integrations/metrics", "bb-mcap"),
        ("integrations/metrics", "bb-cli"),
    ] {
        assert!(!depends(krate, on), "{krate} must not depend on {on}");
    }
}

/// What a user may leave out is in `integrations/`, so that the top level is what the project is.
#[test]
fn the_top_level_is_the_project() {
    let entries = std::fs::read_dir(root()).expect("it is the checkout");
    let mut crates: Vec<_> = entries
        .flatten()
        .filter(|entry| entry.path().join("Cargo.toml").exists())
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect();
    crates.sort();
    assert_eq!(crates, ["bb-cli", "bb-core", "bb-estimators", "bb-macros", "benches", "examples", "tests"]);
}

/// The folders of the runtime, from the bottom up.
const LAYERS: [&str; 17] = [
    "fault",
    "time",
    "message",
    "payload",
    "pubsub",
    "topology",
    "kinematics",
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

/// All files of code below a folder, without those of tests.
fn code_below(folder: &Path, files: &mut Vec<PathBuf>) {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    for path in entries.flatten().map(|entry| entry.path()) {
        let name = path.file_stem().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        if name == "tests" || name == "model" {
            continue;
        }
        if path.is_dir() {
            code_below(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
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

/// The modules of a crate by path, each with its code.
fn modules_of(krate: &str) -> BTreeMap<Vec<String>, String> {
    let source = root().join(krate).join("src");
    let mut files = Vec::new();
    code_below(&source, &mut files);
    if source.join("model").is_dir() {
        // That name is left out above for the model checker's.
        code_below(&source.join("model"), &mut files);
        files.push(source.join("model.rs"));
    }
    let module = |file: PathBuf| {
        let inside = file.strip_prefix(&source).expect("it is below").with_extension("");
        let path: Vec<String> = inside.iter().map(|name| name.to_string_lossy().into_owned()).collect();
        let text = std::fs::read_to_string(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        let text = text.split("#[cfg(test)]\nmod ").next().unwrap_or("").to_owned();
        let code: Vec<&str> = text.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
        (path, code.join("\n"))
    };
    files.into_iter().map(module).filter(|(path, _)| *path != ["lib"]).collect()
}

/// The paths that begin with `start`, as far as they are names: those in a group one by one.
fn paths_from(code: &str, start: &str) -> Vec<Vec<String>> {
    let mut paths = Vec::new();
    for (at, _) in code.match_indices(start) {
        if code[..at].ends_with(|c: char| c == '$' || c == '_' || c == ':' || c.is_alphanumeric()) {
            continue;
        }
        read_paths(&code[at + start.len()..], &mut Vec::new(), &mut paths);
    }
    paths
}

/// Reads `a::b` or `a::{b, c::d}` to `paths`, each behind the names `before`; the length that was read.
fn read_paths(code: &str, before: &mut Vec<String>, paths: &mut Vec<Vec<String>>) -> usize {
    let depth = before.len();
    let mut at = 0;
    loop {
        let rest = &code[at..];
        if rest.starts_with('{') {
            at += 1;
            while !code[at..].starts_with('}') && at < code.len() {
                let read = read_paths(&code[at..], before, paths);
                at += read.max(1);
            }
            before.truncate(depth);
            return at + 1;
        }
        let length =
            rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').map(char::len_utf8).sum::<usize>();
        if length == 0 {
            break;
        }
        before.push(rest[..length].to_owned());
        at += length;
        match code[at..].strip_prefix("::") {
            Some(_) => at += 2,
            None => break,
        }
    }
    if before.len() > depth {
        paths.push(before.clone());
    }
    before.truncate(depth);
    at
}

#[test]
fn groups_of_paths_are_read_one_by_one() {
    let code = "use super::a::{b, c::{d, e}};\nlet x = super::f();\nmy_super::g();";
    let paths: Vec<String> = paths_from(code, "super::").iter().map(|path| path.join("::")).collect();
    assert_eq!(paths, ["a::b", "a::c::d", "a::c::e", "f"]);
}

/// Neither the folders of a crate nor the files in one of them import each other in a circle. What a folder's own file
/// offers to those in it, as types that hold each other, is no import of theirs.
#[test]
fn no_modules_import_each_other_in_a_circle() {
    for krate in ["bb-macros", "bb-cli", "integrations/mcap", "integrations/metrics"] {
        let circles = circles_of(krate);
        assert!(circles.is_empty(), "{krate}: {circles:#?}");
    }
    // Of the others, the folders below `lib.rs`; see the lists of their layers as well.
    for krate in ["bb-core", "bb-estimators"] {
        let circles: Vec<_> = circles_of(krate).into_iter().filter(|circle| circle.starts_with("lib: ")).collect();
        assert!(circles.is_empty(), "{krate}: {circles:#?}");
    }
}

fn circles_of(krate: &str) -> Vec<String> {
    let modules = modules_of(krate);
    // Of each folder, which of its modules import which others.
    let mut imports: BTreeMap<Vec<String>, BTreeMap<String, BTreeSet<String>>> = BTreeMap::new();
    for (module, code) in &modules {
        let absolute = paths_from(code, "crate::");
        let above = &module[..module.len() - 1];
        let beside = paths_from(code, "super::").into_iter().map(|path| [above.to_vec(), path].concat());
        for path in absolute.into_iter().chain(beside) {
            // The part of the path that is modules.
            let is_module = |length: &usize| modules.contains_key(&path[..*length]);
            let Some(length) = (1..=path.len()).rev().find(is_module) else { continue };
            let shared = module.iter().zip(&path[..length]).take_while(|(one, other)| one == other).count();
            if shared < module.len() && shared < length {
                let folder = imports.entry(module[..shared].to_vec()).or_default();
                folder.entry(module[shared].clone()).or_default().insert(path[shared].clone());
            }
        }
    }
    if krate == "bb-macros" {
        assert!(imports[&Vec::new()]["verify"].contains("model"), "imports are found");
        assert!(imports[&vec!["expand".to_owned()]]["wiring"].contains("types"), "imports are found");
    }
    let mut circles = Vec::new();
    for (folder, imports) in &imports {
        for start in imports.keys() {
            let mut reached: BTreeSet<&String> = BTreeSet::new();
            let mut next: Vec<&String> = imports[start].iter().collect();
            while let Some(module) = next.pop() {
                if reached.insert(module) {
                    next.extend(imports.get(module).into_iter().flatten());
                }
            }
            if reached.contains(start) {
                let folder = if folder.is_empty() { "lib".to_owned() } else { folder.join("/") };
                circles.push(format!("{folder}: {start} imports itself, through {reached:?}"));
            }
        }
    }
    circles
}

/// The modules of the algorithms, from the bottom up.
const ALGORITHMS: [&str; 5] = ["params", "attitude", "navigation", "calibration", "simulation"];

/// The code of a file without its tests and comments.
fn code_of(file: &Path) -> String {
    let text = std::fs::read_to_string(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let text = text.split("#[cfg(test)]\nmod ").next().unwrap_or("");
    let code: Vec<&str> = text.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
    code.join("\n")
}

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

/// Which module of `attitude` each of its public names is from.
fn homes(attitude: &str, list: &str) -> std::collections::BTreeMap<String, String> {
    let mut homes = std::collections::BTreeMap::new();
    for statement in attitude.split("pub use ").skip(1).filter_map(|rest| rest.split(';').next()) {
        let Some((module, names)) = statement.split_once("::") else { continue };
        for name in names.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|name| !name.is_empty()) {
            homes.insert(name.to_owned(), module.to_owned());
        }
    }
    for line in list.lines() {
        let words: Vec<&str> = line.trim().trim_end_matches(';').split(' ').collect();
        if let [module, _, filter, params] = *words {
            homes.insert(filter.to_owned(), module.to_owned());
            homes.insert(params.to_owned(), module.to_owned());
        }
    }
    homes
}

#[test]
fn modules_of_attitude_form_no_circle() {
    let source = root().join("bb-estimators/src/attitude");
    let list = code_of(&source.join("filters.rs"));
    let homes = homes(&code_of(&source.with_extension("rs")), &list);
    assert_eq!(homes.get("MekfParams").map(String::as_str), Some("mekf"), "the list is read");
    let mut files = Vec::new();
    code_below(&source, &mut files);
    let mut edges: std::collections::BTreeMap<String, std::collections::BTreeSet<String>> = Default::default();
    for file in files {
        let inside = file.strip_prefix(&source).expect("it is below").to_string_lossy().into_owned();
        let module = inside.split('/').next().unwrap_or("").trim_end_matches(".rs").to_owned();
        if module == "laws" {
            continue;
        }
        let mut code = code_of(&file).replace("crate::attitude::", "crate::");
        if !inside.contains('/') {
            code = code.replace("super::", "crate::");
        }
        let mut named: Vec<String> = named_in_crate(&code).into_iter().map(str::to_owned).collect();
        if module == "any" {
            // What its macro names of every line of the list.
            named.extend(list.lines().filter_map(|line| Some(line.trim().split_once(' ')?.0.to_owned())));
        }
        let named = named.into_iter().map(|name| homes.get(&name).cloned().unwrap_or(name));
        let is_module =
            |name: &String| source.join(name).with_extension("rs").exists() || source.join(name).is_dir();
        edges.entry(module.clone()).or_default().extend(named.filter(is_module).filter(|name| *name != module));
    }
    assert!(edges["any"].contains("mekf") && edges["mekf"].contains("rotation"), "{edges:?}");
    // Modules that import nothing that is left are taken away until none is.
    while let Some(free) = edges.iter().find(|(_, named)| named.iter().all(|name| !edges.contains_key(name))) {
        let free = free.0.clone();
        edges.remove(&free);
    }
    assert!(edges.is_empty(), "these import one another: {edges:#?}");
}
