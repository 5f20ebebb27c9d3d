//! The ladder of examples: each prints what is stored beside it, and is short.
//!
//! `UPDATE_EXPECTED=1 cargo test -p bb-examples` writes the stored outputs.

use std::path::{Path, PathBuf};
use std::process::Command;

/// The examples, from the smallest up.
const LADDER: [&str; 12] = [
    "hello",
    "robot",
    "driver",
    "fan_in",
    "estimator",
    "commands",
    "parameters",
    "health",
    "replay",
    "bridge",
    "navigation",
    "no_satellites",
];

/// Most lines of an example.
const LINES: usize = 80;

fn folder() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn source(name: &str) -> String {
    std::fs::read_to_string(folder().join(name).with_extension("rs")).expect("every example has a file")
}

/// The program of an example, which cargo builds beside the tests.
fn program(name: &str) -> PathBuf {
    let test = std::env::current_exe().expect("a test has a path");
    let target = test.ancestors().nth(2).expect("tests are in a folder of the target");
    let program = target.join("examples").join(name).with_extension(std::env::consts::EXE_EXTENSION);
    assert!(program.exists(), "{name} is not built: run `cargo test -p bb-examples`, without `--test`");
    program
}

#[test]
fn examples_print_what_is_stored() {
    let runs: Vec<_> = LADDER
        .iter()
        .map(|name| (name, std::thread::spawn(move || Command::new(program(name)).output().expect("it starts"))))
        .collect();
    for (name, run) in runs {
        let output = run.join().unwrap_or_else(|_| panic!("{name} does not run"));
        let printed = String::from_utf8(output.stdout).expect("an example prints text");
        assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        let stored = folder().join("expected").join(name).with_extension("txt");
        if std::env::var_os("UPDATE_EXPECTED").is_some() {
            std::fs::write(&stored, &printed).expect("the folder is writable");
        }
        assert_eq!(printed, std::fs::read_to_string(&stored).unwrap_or_default(), "{name}");
    }
}

#[test]
fn every_example_is_one_short_file_that_says_how_to_run_it() {
    let manifest = std::fs::read_to_string(folder().join("Cargo.toml")).expect("it is a crate");
    let declared: Vec<&str> =
        manifest.split("[[example]]\nname = \"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
    assert_eq!(declared, LADDER);
    for name in LADDER {
        let source = source(name);
        let lines = source.lines().count();
        assert!(lines <= LINES, "{name} has {lines} lines");
        let first = source.lines().next().unwrap_or("");
        assert!(first.ends_with(&format!("`cargo run --example {name}`")), "{name}: {first}");
    }
    let table = std::fs::read_to_string(folder().join("README.md")).expect("it is there");
    let listed: Vec<&str> = table.split("| [`").skip(1).filter_map(|rest| rest.split('`').next()).collect();
    assert_eq!(listed, LADDER);
}

/// Settings by arguments reach a parameter, as the example says.
#[test]
fn parameters_are_set_by_arguments() {
    let run = |arguments: &[&str]| Command::new(program("parameters")).args(arguments).output().expect("it starts");
    let printed = String::from_utf8(run(&["--set", "param/filter/beta=0.3 rad/s"]).stdout).expect("text");
    assert!(printed.starts_with("beta is 0.3\n"), "{printed}");
    let listed = String::from_utf8(run(&["--list"]).stdout).expect("text");
    assert!(listed.contains("[param.filter]"), "{listed}");
}
