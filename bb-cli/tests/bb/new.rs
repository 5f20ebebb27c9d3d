//! `bb new`: the project compiles, its tests pass, and it records.

use crate::common::bb;
use std::path::{Path, PathBuf};
use std::process::Command;

const WORKSPACE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// `bb new` in a folder of the tests.
fn new(arguments: &[&str]) -> (Option<i32>, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_bb"))
        .current_dir(env!("CARGO_TARGET_TMPDIR"))
        .arg("new")
        .args(arguments)
        .output()
        .expect("runs");
    let said = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).expect("is text")).concat();
    (output.status.code(), said)
}

#[test]
#[ignore = "builds a project with features of its own, and with them the runtime: .ci/run runs it"]
fn the_project_compiles_passes_its_tests_and_records() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fresh-oven");
    let _ = std::fs::remove_dir_all(&folder);
    let (code, said) = new(&["fresh-oven", "--path", WORKSPACE]);
    assert_eq!((code, &*said), (Some(0), "created fresh-oven; next: cd fresh-oven && cargo run\n"));

    // The versions that the workspace has, so that nothing is fetched, and what it has built.
    std::fs::copy(Path::new(WORKSPACE).join("Cargo.lock"), folder.join("Cargo.lock")).expect("copies");
    let target = Path::new(env!("CARGO_BIN_EXE_bb")).ancestors().nth(2).expect("target/debug/bb");
    let profiles = profiles();
    let cargo = |command: &[&str]| {
        let output = Command::new(env!("CARGO"))
            .current_dir(&folder)
            .args([&command[..1], &["--offline", "--quiet"]].concat())
            .args(profiles.iter().flat_map(|profile| ["--config", profile]))
            .args(&command[1..])
            .env("CARGO_TARGET_DIR", target)
            .output()
            .expect("runs");
        let text = |bytes| String::from_utf8(bytes).expect("is text");
        let (out, err) = (text(output.stdout), text(output.stderr));
        assert!(output.status.success() && !err.contains("warning"), "cargo {command:?}\n{out}\n{err}");
        (out, err)
    };
    let (tests, _) = cargo(&["test"]);
    assert!(tests.contains("2 passed"), "{tests}");
    let (run, logs) = cargo(&["run", "--", "2"]);
    assert!(logs.contains(" INFO ") && !logs.contains('\u{1b}'), "no colours where it is no terminal: {logs}");
    assert!(!logs.contains(" WARN "), "{logs}");
    let recording = recorded(&run, &folder);
    let (list, _) = cargo(&["run", "--", "--list"]);
    assert!(list.contains("[sensor.body.thermometer]"), "{list}");
    let info = bb(&["info", recording.to_str().expect("is text")]);
    assert_eq!(info.code, Some(0), "{}", info.err);
    assert!(info.out.contains("/sensor/body/thermometer/smooth  "), "{}", info.out);
    let echo = bb(&["echo", recording.to_str().expect("is text"), "sensor/body/thermometer", "--limit", "1"]);
    assert!(echo.out.contains("temperature_k: 29"), "{}", echo.out);
    let hz = bb(&["hz", recording.to_str().expect("is text")]);
    let cells = |topic: &str| {
        let line = hz.out.lines().find(|line| line.split_whitespace().next() == Some(topic)).expect("is there");
        line.split_whitespace().skip(2).map(str::to_owned).collect::<Vec<_>>()
    };
    assert!(cells("/safety").iter().all(|cell| cell == "-"), "events have no rate: {}", hz.out);

    // Ctrl-C ends it as its time does; and two that begin at once have a file each.
    #[cfg(unix)]
    {
        use std::io::{BufRead, BufReader, Read};
        let start = || {
            let mut command = Command::new(target.join("debug/fresh-oven"));
            let command = command
                .current_dir(&folder)
                .stdout(std::process::Stdio::piped())
                .stderr(std::process::Stdio::null());
            command.spawn().expect("runs")
        };
        let files = [start(), start()].map(|mut child| {
            // It handles signals before it prints.
            let mut out = BufReader::new(child.stdout.take().expect("is piped"));
            let mut printed = String::new();
            out.read_line(&mut printed).expect("is text");
            let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
            assert!(kill.expect("runs").success(), "it still runs");
            out.read_to_string(&mut printed).expect("is text");
            let status = child.wait().expect("ends");
            assert!(status.success(), "{status:?}");
            recorded(&printed, &folder)
        });
        assert_ne!(files[0], files[1]);
        for file in files {
            let info = bb(&["info", file.to_str().expect("is text")]);
            assert_eq!(info.code, Some(0), "it is whole: {}", info.err);
        }
    }
}

/// Returns the profile `dev` of the workspace as configuration: with anything else, cargo would compile every dependency again.
fn profiles() -> Vec<String> {
    let manifest = std::fs::read_to_string(Path::new(WORKSPACE).join("Cargo.toml")).expect("reads");
    let tables = manifest.split("\n[").filter_map(|table| table.split_once("]\n"));
    let profiles = tables.filter(|(name, _)| {
        *name == "profile.dev" || *name == "profile.dev.build-override" || name.starts_with("profile.dev.package.")
    });
    let profiles: Vec<_> = profiles
        .flat_map(|(name, settings)| {
            let settings = settings.lines().filter(|line| line.contains(" = ") && !line.starts_with('#'));
            settings.map(move |line| format!("{name}.{}", line.replace(' ', "")))
        })
        .collect();
    for expected in ["profile.dev.debug=\"line-tables-only\"", "profile.dev.package.nalgebra.opt-level=2"] {
        assert!(profiles.iter().any(|profile| profile == expected), "{expected}: {profiles:?}");
    }
    profiles
}

/// The recording that a run names.
fn recorded(out: &str, folder: &Path) -> PathBuf {
    let line = out.lines().find(|line| line.contains("look at it with")).expect("it is recorded");
    folder.join(line.split(':').next().expect("is named"))
}

#[test]
fn what_is_there_is_not_touched() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("taken");
    std::fs::create_dir_all(&folder).expect("makes");
    let (code, said) = new(&["taken"]);
    assert_eq!((code, &*said), (Some(1), "error: taken exists already; choose another name, or remove it\n"));
    assert_eq!(std::fs::read_dir(&folder).expect("is there").count(), 0);
    let (code, said) = new(&["2wheels"]);
    assert_eq!(code, Some(2));
    assert!(said.contains("a package's name begins with a letter"), "{said}");
    let (code, said) = new(&["elsewhere", "--path", "taken"]);
    assert_eq!((code, &*said), (Some(1), "error: taken is not a checkout of bb: it has no bb-core/Cargo.toml\n"));
    assert!(!folder.with_file_name("elsewhere").exists());
}
