//! The language reference against the grammar: what is read is described, and what is described is read.

use super::{diagnostics, tokens};
use crate::parse::WORDS;
use crate::units::symbols;

fn reference() -> String {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../bb-core/src/robot.md");
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// The texts between backticks, outside of code blocks.
fn quoted(text: &str) -> Vec<String> {
    let prose: String = text.split("```").step_by(2).collect();
    prose.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

#[test]
fn every_word_that_starts_an_item_is_described() {
    let quoted = quoted(&reference());
    for word in WORDS {
        let starts =
            |text: &&String| text.strip_prefix(word).is_some_and(|rest| !rest.starts_with(char::is_alphanumeric));
        let is_abbreviated = word.starts_with("on_") && quoted.iter().any(|text| text.starts_with(word));
        assert!(quoted.iter().any(|text| starts(&text)) || is_abbreviated, "`{word}` is not in the reference");
    }
}

#[test]
fn every_setting_that_is_described_is_read() {
    // The first word of what stands in the first column of a table, where it has the form of a setting.
    let reference = reference();
    let rows = reference.lines().filter(|line| line.starts_with("| `"));
    let mut settings = 0;
    for row in rows {
        let first = row.split('|').nth(1).unwrap_or("");
        for text in first.split('`').skip(1).step_by(2) {
            let word: String = text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            if text.ends_with(';') && text.contains(':') && !text.contains("Type") && !text.contains(" name") {
                settings += 1;
                assert!(WORDS.contains(&&*word), "the reference describes `{text}`, which is not read");
            }
        }
    }
    assert!(settings > 15, "only {settings} settings were found");
}

#[test]
fn every_robot_of_the_reference_verifies() {
    let mut robots = 0;
    for block in reference().split("```").skip(1).step_by(2) {
        // Hidden lines are compiled as well; here it is the robots alone.
        let code: String =
            block.lines().map(|line| line.strip_prefix("# ").unwrap_or(line).to_owned() + "\n").collect();
        let Some(start) = code.find("robot! {") else { continue };
        let robot = tokens(&code[start + "robot!".len()..]);
        let Some(proc_macro2::TokenTree::Group(group)) = robot.into_iter().next() else {
            panic!("`robot!` without braces in {code}")
        };
        if group.to_string().contains("urdf") {
            continue;
        }
        let faults = diagnostics(group.stream());
        assert!(faults.is_empty(), "{faults:?} in {code}");
        robots += 1;
    }
    assert!(robots >= 8, "only {robots} robots were found");
}

#[test]
fn the_units_of_the_reference_are_those_that_are_read() {
    let reference = reference();
    let start = reference.find("Units are ").expect("they are listed");
    let list = &reference[start..start + reference[start..].find("and products").expect("the list ends")];
    let described: Vec<String> = quoted(list);
    for symbol in symbols() {
        let plain = symbol.replace('µ', "u");
        assert!(described.contains(&plain), "`{symbol}` is not in the reference");
    }
    for unit in described.iter().filter(|unit| !["µ", "u"].contains(&unit.as_str())) {
        assert!(symbols().any(|symbol| symbol == unit), "`{unit}` is no unit");
    }
}

#[test]
fn the_defaults_of_the_reference_hold() {
    let robot = crate::model::resolve(crate::parse::robot(
        tokens("robot Rover; commands { stop: Stop; } link base { sensor imu: A() { estimator tilt: B(); } }"),
        &mut crate::diagnostics::Diagnostics::default(),
    ));
    let estimator = &robot.estimators[0];
    assert_eq!((estimator.health.recover_after, estimator.health.latency_budget_s), (1, None));
    assert_eq!((estimator.health.lost_after_s, estimator.worker.is_none()), (None, true));
    let command = &robot.commands[0];
    assert_eq!((command.timeout_s, command.category, &command.cancel), (None, 0, &crate::model::Cancel::Nothing));
    assert_eq!((robot.categories[0].concurrency, robot.categories[0].name.to_string()), (1, "default".to_owned()));
}
