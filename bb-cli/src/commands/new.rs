//! `bb new`: a project that runs.

use clap::Args;
use std::fs;
use std::path::{Path, PathBuf};

/// Creates a project that compiles and runs: its own sensor and estimator, tests, a recording, logs.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The name of the package and of the folder, which must not exist yet.
    #[arg(value_name = "NAME", value_parser = package)]
    name: String,
    /// The checkout of bb that the project depends on. [default: the one that this command was built from, if it still
    /// exists; else the published crates]
    #[arg(long, value_name = "FOLDER")]
    path: Option<PathBuf>,
}

/// The files to write, and their contents.
const FILES: [(&str, &str); 6] = [
    ("Cargo.toml", include_str!("../../templates/project/Cargo.toml.template")),
    ("README.md", include_str!("../../templates/project/README.md.template")),
    (".gitignore", include_str!("../../templates/project/gitignore")),
    ("src/main.rs", include_str!("../../templates/project/src/main.rs")),
    ("src/thermometer.rs", include_str!("../../templates/project/src/thermometer.rs")),
    ("src/low_pass.rs", include_str!("../../templates/project/src/low_pass.rs")),
];

/// The crates that a project depends on, where they are in a checkout, and the features that it needs: Ctrl-C.
const CRATES: [(&str, &str, &[&str]); 2] =
    [("bb-core", "bb-core", &["signals"]), ("bb-mcap", "integrations/mcap", &[])];

/// Folder of the sources from which this command was built.
const CHECKOUT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

pub(super) fn run(arguments: &Arguments) -> Result<bool, String> {
    let Arguments { name, path } = arguments;
    let dependencies = dependencies(path.as_deref())?;
    let folder = Path::new(name);
    fs::create_dir(folder).map_err(|error| match error.kind() {
        std::io::ErrorKind::AlreadyExists => format!("{name} exists already; choose another name, or remove it"),
        _ => format!("{name} cannot be created: {error}"),
    })?;
    for (file, text) in FILES {
        let text = text.replace("{{name}}", name).replace("{{dependencies}}", &dependencies);
        let path = folder.join(file);
        let made = path.parent().map_or(Ok(()), fs::create_dir_all).and_then(|()| fs::write(&path, text));
        made.map_err(|error| format!("{} cannot be written: {error}", path.display()))?;
    }
    crate::say(&format!("created {name}; next: cd {name} && cargo run\n"))?;
    Ok(true)
}

/// Checks that cargo accepts the name for a package, and that it does not shadow a crate.
fn package(name: &str) -> Result<String, String> {
    const OTHER_CRATES: [&str; 14] = [
        "test",
        "core",
        "std",
        "alloc",
        "proc_macro",
        "proc-macro",
        "bb",
        "bb-core",
        "bb-mcap",
        "bb-macros",
        "tracing-subscriber",
        "build",
        "deps",
        "examples",
    ];
    const KEYWORDS: [&str; 52] = [
        "abstract", "as", "async", "await", "become", "box", "break", "const", "continue", "crate", "do", "dyn",
        "else", "enum", "extern", "false", "final", "fn", "for", "gen", "if", "impl", "in", "let", "loop", "macro",
        "match", "mod", "move", "mut", "override", "priv", "pub", "ref", "return", "self", "Self", "static",
        "struct", "super", "trait", "true", "try", "type", "typeof", "unsafe", "unsized", "use", "virtual",
        "where", "while", "yield",
    ];
    let is_letter = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if !name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        return Err("a package's name begins with a letter".into());
    }
    if let Some(other) = name.chars().find(|c| !is_letter(*c)) {
        return Err(format!("a package's name has no `{other}`, but letters, digits, `-` and `_`"));
    }
    if KEYWORDS.contains(&name) {
        return Err(format!("`{name}` is a word of Rust"));
    }
    if OTHER_CRATES.contains(&name) {
        return Err(format!("`{name}` is the name of another crate"));
    }
    Ok(name.to_owned())
}

/// The lines of the manifest.
fn dependencies(path: Option<&Path>) -> Result<String, String> {
    let has_all =
        |checkout: &Path| CRATES.iter().all(|(_, folder, _)| checkout.join(folder).join("Cargo.toml").is_file());
    let checkout = match path {
        Some(path) if !has_all(path) => {
            return Err(format!("{} is not a checkout of bb: it has no bb-core/Cargo.toml", path.display()));
        }
        Some(path) => Some(path),
        None => Some(Path::new(CHECKOUT)).filter(|checkout| has_all(checkout)),
    };
    let checkout = checkout
        .map(|path| path.canonicalize().map_err(|error| format!("{}: {error}", path.display())))
        .transpose()?;
    let lines = CRATES.map(|(name, folder, features)| {
        let from = match &checkout {
            // A TOML string in single quotes has no escapes, as needed for Windows paths.
            Some(checkout) => format!("path = '{}'", checkout.join(folder).display()),
            None => format!("version = \"{}\"", env!("CARGO_PKG_VERSION")),
        };
        match features.is_empty() {
            true => format!("{name} = {{ {from} }}"),
            false => format!("{name} = {{ {from}, features = {features:?} }}"),
        }
    });
    Ok(lines.join("\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_packages() {
        for name in ["oven", "my-robot", "r2_d2", "X"] {
            assert_eq!(package(name).as_deref(), Ok(name));
        }
        let fault = |name: &str| package(name).expect_err("is refused");
        assert_eq!(fault("2wheels"), "a package's name begins with a letter");
        assert_eq!(fault(""), "a package's name begins with a letter");
        assert_eq!(fault("../oven"), "a package's name begins with a letter");
        assert_eq!(fault("my robot"), "a package's name has no ` `, but letters, digits, `-` and `_`");
        assert_eq!(fault("a/b"), "a package's name has no `/`, but letters, digits, `-` and `_`");
        assert_eq!(fault("loop"), "`loop` is a word of Rust");
        assert_eq!(fault("bb-core"), "`bb-core` is the name of another crate");
    }

    #[test]
    fn a_folder_that_is_no_checkout_is_refused() {
        let fault = dependencies(Some(Path::new("/"))).expect_err("is none");
        assert_eq!(fault, "/ is not a checkout of bb: it has no bb-core/Cargo.toml");
        assert!(dependencies(None).expect("is one").contains("bb-core = { path = '"));
    }
}
