//! The crates and the arrows between them.

use super::{read, root};

#[test]
fn arrows_between_crates_point_one_way() {
    let depends = |krate: &str, on: &str| {
        let manifest = read(&format!("{krate}/Cargo.toml"));
        let dependencies = manifest.split("[dependencies]").nth(1).unwrap_or("");
        let dependencies = dependencies.split("\n[").next().unwrap_or("");
        dependencies.lines().any(|line| line.starts_with(on))
    };
    for (krate, on) in [
        ("bb-message", "bb-macros"),
        ("bb-kinematics", "bb-message"),
        ("bb-core", "bb-macros"),
        ("bb-core", "bb-message"),
        ("bb-core", "bb-kinematics"),
    ] {
        assert!(depends(krate, on), "{krate} depends on {on}");
    }
    for (krate, on) in [
        ("bb-message", "bb-core"),
        ("bb-message", "bb-kinematics"),
        ("bb-kinematics", "bb-core"),
        ("bb-kinematics", "bb-macros"),
        ("bb-estimators", "bb-message"),
        ("bb-estimators", "bb-kinematics"),
        ("bb-macros", "bb-core"),
        ("bb-macros", "bb-estimators"),
        ("bb-core", "bb-estimators"),
        ("bb-core", "bb-command"),
        ("bb-core", "bb-eval"),
        ("bb-core", "bb-dashboard"),
        ("bb-core", "bb-mavlink"),
        ("bb-core", "bb-mcap"),
        ("bb-core", "bb-metrics"),
        ("bb-core", "bb-redb"),
        ("bb-estimators", "bb-macros"),
        ("bb-estimators", "bb-command"),
        ("bb-estimators", "bb-eval"),
        ("bb-eval", "bb-command"),
        ("bb-eval", "bb-macros"),
        ("demos/attitude", "bb-command"),
        ("demos/attitude", "clap"),
        ("integrations/plot", "bb-"),
        ("bb-estimators", "bb-mavlink"),
        ("bb-estimators", "bb-mcap"),
        ("bb-estimators", "bb-metrics"),
        ("bb-estimators", "bb-redb"),
        ("bb-cli", "bb-dashboard"),
        ("integrations/dashboard", "bb-macros"),
        ("integrations/dashboard", "bb-estimators"),
        ("integrations/dashboard", "bb-mcap"),
        ("integrations/mavlink", "bb-macros"),
        ("integrations/mavlink", "bb-mcap"),
        ("integrations/mavlink", "bb-metrics"),
        ("integrations/mavlink", "bb-command"),
        ("integrations/mavlink", "bb-eval"),
        ("integrations/mcap", "bb-macros"),
        ("integrations/mcap", "bb-estimators"),
        ("integrations/mcap", "bb-metrics"),
        ("integrations/mcap", "bb-command"),
        ("integrations/mcap", "bb-eval"),
        ("integrations/metrics", "bb-macros"),
        ("integrations/metrics", "bb-estimators"),
        ("integrations/metrics", "bb-mcap"),
        ("integrations/metrics", "bb-command"),
        ("integrations/metrics", "bb-eval"),
        ("integrations/redb", "bb-macros"),
        ("integrations/redb", "bb-estimators"),
        ("integrations/redb", "bb-command"),
        ("integrations/ros2", "bb-"),
        ("integrations/foxglove", "bb-macros"),
        ("integrations/foxglove", "bb-estimators"),
        ("integrations/foxglove", "bb-mcap"),
        ("integrations/foxglove", "bb-cli"),
        ("integrations/foxglove", "bb-eval"),
        ("integrations/zenoh", "bb-macros"),
        ("integrations/zenoh", "bb-estimators"),
        ("integrations/zenoh", "bb-mcap"),
        ("integrations/zenoh", "bb-cli"),
        ("integrations/zenoh", "bb-eval"),
    ] {
        assert!(!depends(krate, on), "{krate} must not depend on {on}");
    }
}

/// Optional crates are in `integrations/`, so that the top level is what the project is.
#[test]
fn the_top_level_is_the_project() {
    let entries = std::fs::read_dir(root()).expect("it is the checkout");
    let mut crates: Vec<_> = entries
        .flatten()
        .filter(|entry| entry.path().join("Cargo.toml").exists())
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect();
    crates.sort();
    assert_eq!(
        crates,
        [
            "bb-cli",
            "bb-core",
            "bb-estimators",
            "bb-eval",
            "bb-kinematics",
            "bb-macros",
            "bb-message",
            "benches",
            "demos",
            "examples",
            "tests"
        ]
    );
}

/// A published crate says what it is for, and the toolchain that builds everything is the oldest that the crates promise.
#[test]
fn published_crates_are_described() {
    for krate in super::CRATES {
        let manifest = read(&format!("{krate}/Cargo.toml"));
        for key in ["description = \"", "keywords = [", "categories = [", "readme", "license", "rust-version"] {
            assert!(manifest.lines().any(|line| line.starts_with(key)), "{krate}/Cargo.toml has no `{key}`");
        }
    }
    let value = |file: &str, key: &str| {
        let text = read(file);
        let line = text
            .lines()
            .find(|line| line.starts_with(key))
            .unwrap_or_else(|| panic!("{file}: no {key}"))
            .to_owned();
        line.split('"').nth(1).map(str::to_owned)
    };
    let promised = value("Cargo.toml", "rust-version").expect("a version");
    let used = value("rust-toolchain.toml", "channel").expect("a version");
    assert!(
        used == promised || used == format!("{promised}.0"),
        "rust-version {promised} is not checked by {used}"
    );
}

/// Every published crate has a changelog of the current version, of what it offers and what it does not, and the first page links it.
#[test]
fn published_crates_have_changelogs() {
    let workspace = read("Cargo.toml");
    let version = workspace.lines().find_map(|line| line.strip_prefix("version = \"")).expect("a version");
    let version = version.trim_end_matches('"');
    let overview = read("CHANGELOG.md");
    for krate in super::CRATES {
        let manifest = read(&format!("{krate}/Cargo.toml"));
        let name = manifest.lines().find_map(|line| line.strip_prefix("name = \"")).expect("a name");
        let name = name.trim_end_matches('"');
        let changes = read(&format!("{krate}/CHANGELOG.md"));
        for line in [format!("# Changelog of {name}"), "### Known limits".to_owned()] {
            assert!(changes.lines().any(|other| other == line), "{krate}/CHANGELOG.md has no line `{line}`");
        }
        assert!(changes.contains(&format!("\n## {version}")), "{krate}/CHANGELOG.md has nothing of {version}");
        let link = format!("({krate}/CHANGELOG.md)");
        assert!(overview.contains(&format!("| `{name}`")) && overview.contains(&link), "CHANGELOG.md lacks {name}");
    }
}
