//! No modules import each other in a circle, at any level of any crate.

use super::modules::{Module, Modules};
use super::{CRATES, code_of, root};
use std::collections::{BTreeMap, BTreeSet};

/// Neither the folders of a crate nor the files in one of them import each other in a circle. A name that a folder re-exports
/// counts as the module's that defines it. What a folder's own file defines, its files may import: it is their header.
#[test]
fn no_modules_import_each_other_in_a_circle() {
    let all: Vec<String> = CRATES.into_iter().flat_map(circles_of).collect();
    assert!(all.is_empty(), "{all:#?}");
}

/// Imports of each folder: which of its modules import which others.
type Imports = BTreeMap<Module, BTreeMap<String, BTreeSet<String>>>;

fn circles_of(krate: &str) -> Vec<String> {
    let mut modules = Modules::of(krate);
    let mut imports = Imports::new();
    if krate == "bb-estimators" {
        add_filters(&mut modules, &mut imports);
    }
    for (module, home) in modules.imports() {
        let shared = module.iter().zip(&home).take_while(|(one, other)| one == other).count();
        if shared < module.len() && shared < home.len() {
            let folder = imports.entry(module[..shared].to_vec()).or_default();
            folder.entry(module[shared].clone()).or_default().insert(home[shared].clone());
        }
    }
    let is_found = |folder: &[&str], from: &str, to: &str| {
        let folder: Module = folder.iter().map(|name| (*name).to_owned()).collect();
        assert!(imports[&folder][from].contains(to), "{krate}: {from} imports {to}");
    };
    match krate {
        "bb-macros" => is_found(&["expand"], "wiring", "types"),
        // By a name that the folder re-exports, and by one of another folder.
        "bb-core" => (is_found(&["run"], "live", "report"), is_found(&[], "joints", "pubsub")).0,
        "bb-estimators" => (is_found(&["attitude"], "any", "mekf"), is_found(&["attitude"], "mekf", "rotation")).0,
        _ => {}
    }
    let name = |folder: &Module| {
        if folder.is_empty() { krate.to_owned() } else { format!("{krate}/{}", folder.join("/")) }
    };
    imports.iter().flat_map(|(folder, imports)| circles_in(&name(folder), imports)).collect()
}

/// The circles of one folder, each with the arrows that make it.
fn circles_in(folder: &str, imports: &BTreeMap<String, BTreeSet<String>>) -> Vec<String> {
    let reached = |start: &String| {
        let mut reached: BTreeSet<&String> = BTreeSet::new();
        let mut next: Vec<&String> = imports.get(start).into_iter().flatten().collect();
        while let Some(module) = next.pop() {
            if reached.insert(module) {
                next.extend(imports.get(module).into_iter().flatten());
            }
        }
        reached
    };
    let mut circles = Vec::new();
    for (from, to) in imports.iter().flat_map(|(from, all)| all.iter().map(move |to| (from, to))) {
        if reached(to).contains(from) {
            circles.push(format!("{folder}: {from} imports {to}, which imports {from}"));
        }
    }
    circles
}

/// The names that the list of filters puts into `attitude`, and what its macro names in `any`.
fn add_filters(modules: &mut Modules, imports: &mut Imports) {
    let list = code_of(&root().join("bb-estimators/src/attitude/filters.rs"));
    let attitude = imports.entry(vec!["attitude".to_owned()]).or_default();
    for line in list.lines() {
        let words: Vec<&str> = line.trim().trim_end_matches(';').split(' ').collect();
        if let [module, _, filter, params] = *words {
            modules.add_name(&["attitude"], filter, &[module, filter]);
            modules.add_name(&["attitude"], params, &[module, params]);
            attitude.entry("any".to_owned()).or_default().insert(module.to_owned());
        }
    }
}

#[test]
fn a_circle_is_found() {
    let imports = |all: &[(&str, &str)]| {
        let mut imports: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for (from, to) in all {
            imports.entry((*from).to_owned()).or_default().insert((*to).to_owned());
        }
        imports
    };
    assert_eq!(circles_in("x", &imports(&[("a", "b"), ("b", "c"), ("a", "c")])), [] as [&str; 0]);
    assert_eq!(circles_in("x", &imports(&[("a", "b"), ("b", "c"), ("c", "b")])).len(), 2);
}
