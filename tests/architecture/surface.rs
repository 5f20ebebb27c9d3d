//! Public items of the runtime: those that a program names which uses it. Plumbing is exported by `__private` alone.

use super::modules::public_names_in;
use super::{code_of, root};
use std::path::Path;

/// The stored list is read before it is renewed: each name in it is a promise.
#[test]
fn the_public_names_of_the_runtime_are_those_on_the_list() {
    let source = root().join("bb-core/src");
    let mut lines = Vec::new();
    list("bb_core", &code_of(&source.join("lib.rs")), &source, &mut lines);
    // Modules of the crates below, which the runtime re-exports.
    for (krate, module) in [
        ("bb-message", "message"),
        ("bb-message", "payload"),
        ("bb-kinematics", "kinematics"),
        ("bb-kinematics", "topology"),
        ("bb-message", "time"),
    ] {
        let source = root().join(krate).join("src");
        lines.retain(|line| *line != format!("bb_core::{module}"));
        let code = code_of(&source.join(module).with_extension("rs"));
        list(&format!("bb_core::{module}"), &code, &source.join(module), &mut lines);
    }
    let found = lines.join("\n") + "\n";
    let file = root().join("tests/architecture/public.txt");
    if std::env::var_os("UPDATE_PUBLIC").is_some() {
        std::fs::write(&file, &found).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    }
    let stored = std::fs::read_to_string(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let differences: Vec<String> = found
        .lines()
        .filter(|line| !stored.lines().any(|other| other == *line))
        .map(|line| format!("not on the list: {line}"))
        .chain(
            stored
                .lines()
                .filter(|line| !found.lines().any(|other| other == *line))
                .map(|line| format!("gone: {line}")),
        )
        .collect();
    assert!(differences.is_empty(), "{differences:#?}\nUPDATE_PUBLIC=1 renews {}", file.display());
}

/// The public names of a module and of those in it, each with its path. `__private` is none of them.
fn list(path: &str, code: &str, folder: &Path, lines: &mut Vec<String>) {
    let inline = |name: &str| {
        let start = format!("pub mod {name} {{");
        code.find(&start)
            .map(|at| code[at + start.len()..].split("\n}").next().unwrap_or("").replace("\n    ", "\n"))
    };
    let mut outer = code.to_owned();
    let mut modules = Vec::new();
    for name in code.lines().filter_map(|line| line.strip_prefix("pub mod ")) {
        match name.split_once([' ', ';']) {
            Some((name, "")) => modules.push((name, code_of(&folder.join(name).with_extension("rs")))),
            Some((name, _)) => {
                let inner = inline(name).unwrap_or_default();
                outer = outer.replace(&inner.replace('\n', "\n    "), "");
                if name != "__private" {
                    modules.push((name, inner.trim_start().to_owned()));
                }
            }
            None => panic!("{path}: `pub mod {name}` is not read"),
        }
    }
    let mut names = public_names_in(&outer);
    names.sort();
    names.dedup();
    lines.extend(names.into_iter().map(|name| format!("{path}::{name}")));
    for (name, code) in modules {
        list(&format!("{path}::{name}"), &code, &folder.join(name), lines);
    }
}

#[test]
fn plumbing_that_becomes_public_is_found() {
    let code = "pub mod outer {\n    pub use crate::a::{B, c};\n}\nuse x::Y;\npub(crate) use d::E;\npub use f::G as H;\n\
                pub struct I;\npub const fn j() {}\nimpl I {\n    pub fn k() {}\n}\npub mod __private {\n    pub use l::M;\n}\n";
    let mut lines = Vec::new();
    list("x", code, Path::new(""), &mut lines);
    assert_eq!(lines, ["x::H", "x::I", "x::j", "x::outer::B", "x::outer::c"]);
}
