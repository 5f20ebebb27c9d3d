//! The modules of a crate, what each of them re-exports, and which modules its paths lead to.

use super::{code_below, code_of, root};
use std::collections::BTreeMap;

/// A module: its path from the crate's root.
pub(super) type Module = Vec<String>;

/// The modules of one crate. The crate's root is the empty path.
pub(super) struct Modules(BTreeMap<Module, Code>);

struct Code {
    text: String,
    /// Names that the module takes in by a `use` of its own, with their paths.
    names: BTreeMap<String, Vec<String>>,
}

impl Code {
    fn new(text: String) -> Self {
        let names = names_in(&text);
        Self { text, names }
    }
}

impl Modules {
    pub(super) fn of(krate: &str) -> Self {
        let source = root().join(krate).join("src");
        let mut files = Vec::new();
        code_below(&source, &mut files);
        let modules = files.into_iter().map(|file| {
            let inside = file.strip_prefix(&source).expect("it is below").with_extension("");
            let mut path: Module = inside.iter().map(|name| name.to_string_lossy().into_owned()).collect();
            if path == ["lib"] {
                path.clear();
            }
            (path, Code::new(code_of(&file)))
        });
        Self(modules.collect())
    }

    /// Modules as paths and texts. The root's path is empty.
    pub(super) fn from_texts<'a>(texts: impl IntoIterator<Item = (&'a str, &'a str)>) -> Self {
        let path = |path: &str| path.split("::").filter(|name| !name.is_empty()).map(str::to_owned).collect();
        Self(texts.into_iter().map(|(at, text)| (path(at), Code::new(text.to_owned()))).collect())
    }

    pub(super) fn paths(&self) -> impl Iterator<Item = &Module> {
        self.0.keys()
    }

    /// Says what a name of a module is that a macro puts there.
    pub(super) fn add_name(&mut self, module: &[&str], name: &str, path: &[&str]) {
        let owned = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        let code = self.0.get_mut(&owned(module)).expect("it is a module");
        code.names.insert(name.to_owned(), owned(path));
    }

    /// Each module with the modules that define what its paths name.
    pub(super) fn imports(&self) -> Vec<(&Module, Module)> {
        let mut imports = Vec::new();
        for (module, code) in &self.0 {
            let paths = ["crate", "super"].into_iter().flat_map(|start| {
                let rest = paths_from(&code.text, &format!("{start}::"));
                rest.into_iter().map(move |(path, _)| [vec![start.to_owned()], path].concat())
            });
            imports.extend(paths.filter_map(|path| Some((module, self.home(module, &path, 0)?))));
        }
        imports
    }

    /// The module that defines what `path` names, read in `module`; none outside of the crate.
    fn home(&self, module: &[String], path: &[String], depth: usize) -> Option<Module> {
        let mut here = module.to_vec();
        let (first, rest) = path.split_first()?;
        let mut rest = rest;
        match first.as_str() {
            "crate" => here.clear(),
            "self" => {}
            "super" => {
                here.pop();
            }
            // A name of the module itself, or else of another crate.
            name => {
                let child = [module, &[name.to_owned()]].concat();
                if self.0.contains_key(&child) {
                    here = child;
                } else {
                    let path = self.0.get(module)?.names.get(name).filter(|path| path[0] != name && depth < 16)?;
                    return self.home(module, &[path, rest].concat(), depth + 1);
                }
            }
        }
        while let Some((name, after)) = rest.split_first() {
            if name == "super" {
                here.pop();
                rest = after;
                continue;
            }
            let child = [&here[..], std::slice::from_ref(name)].concat();
            if self.0.contains_key(&child) {
                here = child;
                rest = after;
                continue;
            }
            // What the module re-exports is at home where it comes from. What of that is outside of the crate has no home here.
            let Some(path) = self.0.get(&here)?.names.get(name).filter(|_| depth < 16) else { break };
            return self.home(&here, &[path, after].concat(), depth + 1);
        }
        Some(here)
    }
}

/// Collects the names that a module takes in by `use`, with their paths.
fn names_in(code: &str) -> BTreeMap<String, Vec<String>> {
    let mut names = BTreeMap::new();
    for line in code.match_indices("use ").filter(|(at, _)| begins_statement(&code[..*at])) {
        let mut paths = Vec::new();
        read_paths(&code[line.0 + line.1.len()..], &mut Vec::new(), &mut paths);
        for (mut path, alias) in paths {
            if path.last().is_some_and(|last| last == "self") {
                path.pop();
            }
            let Some(name) = alias.or_else(|| path.last().cloned()) else { continue };
            // Of a derive and its trait, which have one name, the trait is of this crate.
            let is_ours = !path[0].starts_with("bb_");
            let is_here = || code.contains(&format!("pub trait {name}"));
            if is_ours || !names.contains_key(&name) && !is_here() {
                names.insert(name, path);
            }
        }
    }
    names
}

/// The names that a module defines or re-exports for everyone, at the margin of its text.
pub(super) fn public_names_in(code: &str) -> Vec<String> {
    let mut names = Vec::new();
    for (at, item) in code.match_indices("pub ").filter(|(at, _)| *at == 0 || code[..*at].ends_with('\n')) {
        let item = &code[at + item.len()..];
        if let Some(path) = item.strip_prefix("use ") {
            let mut paths = Vec::new();
            read_paths(path, &mut Vec::new(), &mut paths);
            names.extend(paths.into_iter().filter_map(|(path, alias)| alias.or_else(|| path.last().cloned())));
            // A glob is named by what it is of.
            names.extend(
                path.split(';').next().and_then(|path| path.strip_suffix("::*")).map(|path| format!("* of {path}")),
            );
        } else if let Some(name) = ["struct ", "enum ", "trait ", "type ", "const fn ", "const ", "static ", "fn "]
            .iter()
            .find_map(|keyword| item.strip_prefix(keyword))
        {
            names.push(name[..name_length(name)].to_owned());
        }
    }
    names
}

/// Returns whether a `use` after this text is a statement at the margin.
fn begins_statement(before: &str) -> bool {
    let line = before.rsplit('\n').next().unwrap_or("");
    line.is_empty() || line == "pub " || line.starts_with("pub(") && line.ends_with(") ")
}

/// A path as names, with the name it is given by `as`.
type Path = (Vec<String>, Option<String>);

/// Returns what follows `start` in the paths that begin with it: those in a group one by one.
pub(super) fn paths_from(code: &str, start: &str) -> Vec<Path> {
    let mut paths = Vec::new();
    for (at, _) in code.match_indices(start) {
        if code[..at].ends_with(|c: char| c == '$' || c == '_' || c == ':' || c.is_alphanumeric()) {
            continue;
        }
        read_paths(&code[at + start.len()..], &mut Vec::new(), &mut paths);
    }
    paths
}

/// Reads `a::b` or `a::{b, c::d as e}` to `paths`, each after the names `before`; returns the length that was read.
fn read_paths(code: &str, before: &mut Vec<String>, paths: &mut Vec<Path>) -> usize {
    let depth = before.len();
    let mut at = 0;
    loop {
        let rest = &code[at..];
        if rest.starts_with('{') {
            at += 1;
            while !code[at..].starts_with('}') && at < code.len() {
                let read = read_paths(&code[at..], before, paths);
                at += read.max(code[at..].chars().next().map_or(1, char::len_utf8));
            }
            before.truncate(depth);
            return at + 1;
        }
        let length = name_length(rest);
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
    let mut alias = None;
    if before.len() > depth
        && let Some(rest) = code[at..].strip_prefix(" as ")
    {
        let length = name_length(rest);
        alias = Some(rest[..length].to_owned());
        at += " as ".len() + length;
    }
    if before.len() > depth {
        paths.push((before.clone(), alias));
    }
    before.truncate(depth);
    at
}

fn name_length(text: &str) -> usize {
    text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').map(char::len_utf8).sum()
}

#[test]
fn groups_of_paths_are_read_one_by_one() {
    let code = "use super::a::{b, c::{d as x, e}};\nlet x = super::f();\nmy_super::g();";
    let read = paths_from(code, "super::").into_iter();
    let paths: Vec<String> = read.map(|(path, alias)| path.join("::") + &alias.unwrap_or_default()).collect();
    assert_eq!(paths, ["a::b", "a::c::dx", "a::c::e", "f"]);
}

#[test]
fn a_name_is_at_home_where_it_is_defined() {
    let modules = Modules::from_texts([
        ("", "pub use a::B;"),
        ("a", "pub(crate) use one::{self, B, C as D};\nuse std::fmt;"),
        ("a::one", "use super::super::a::two::E;"),
        ("a::two", "use super::{B, D, fmt};\nuse crate::B as F;\nuse super::Own;\nuse crate::b::Derived;"),
        ("b", "pub use bb_macros::Derived;\npub trait Derived {}"),
    ]);
    let imports: Vec<String> =
        modules.imports().iter().map(|(from, to)| format!("{} -> {}", from.join("::"), to.join("::"))).collect();
    let expected = [
        "a::one -> a::two",
        "a::two -> a::one",
        "a::two -> b",
        "a::two -> a::one",
        "a::two -> a::one",
        "a::two -> a",
    ];
    assert_eq!(imports, expected);
}
