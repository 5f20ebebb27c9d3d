//! The language reference against the grammar: everything parsed is documented, and everything documented is parsed.

use super::{diagnostics, tokens};
use crate::language::{FIELDS, ITEMS, Value, Word};
use crate::model::Id as _;
use crate::parse::{JointKind, Quantity};
use crate::units::{Dimension, symbols};
use syn::parse::Parser;

const PATH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../bb-core/src/robot.md");

fn reference() -> String {
    std::fs::read_to_string(PATH).unwrap_or_else(|error| panic!("{PATH}: {error}"))
}

/// The texts between backticks, outside of code blocks.
fn quoted(text: &str) -> Vec<String> {
    let prose: String = text.split("```").step_by(2).collect();
    prose.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// The places with words, each with all of its words.
fn places() -> Vec<(&'static str, Vec<&'static Word>)> {
    let mut places: Vec<(&str, Vec<&Word>)> = Vec::new();
    for (place, words) in ITEMS.iter().chain(FIELDS).filter(|(_, words)| !words.is_empty()) {
        match places.iter_mut().find(|(known, _)| known == place) {
            Some((_, known)) => known.extend(*words),
            None => places.push((place, words.to_vec())),
        }
    }
    places
}

/// A place as named in the column `where`: `link` for `a link`.
fn short(place: &str) -> &str {
    place.trim_start_matches("a ").trim_start_matches("an ")
}

/// The table of the words of some places.
fn table(of: &[&str]) -> String {
    let same = |a: &Word, b: &Word| a.text == b.text && a.doc == b.doc;
    let places = places();
    let mut table = "| word | where | meaning |\n|---|---|---|\n".to_owned();
    let mut shown: Vec<&Word> = Vec::new();
    for place in of {
        let words = places.iter().find(|(known, _)| known == place).map(|(_, words)| words);
        for word in words.unwrap_or_else(|| panic!("`{place}` has no words")) {
            if shown.iter().any(|other| same(word, other)) {
                continue;
            }
            shown.push(word);
            let holds = |words: &[&Word]| words.iter().any(|other| same(word, other));
            let places: Vec<&str> =
                places.iter().filter(|(_, words)| holds(words)).map(|(place, _)| short(place)).collect();
            let Word { text, example, doc, .. } = word;
            table.push_str(&format!("| `{text}{example}` | {} | {doc} |\n", places.join(", ")));
        }
    }
    table
}

/// The reference with its tables generated from the language, and the places whose words they have.
fn generated(reference: &str) -> (String, Vec<String>) {
    const START: &str = "<!-- words: ";
    const END: &str = "<!-- end of words -->";
    let (mut text, mut covered) = (String::new(), Vec::new());
    let mut parts = reference.split(START);
    text.push_str(parts.next().unwrap_or(""));
    for part in parts {
        let (list, rest) = part.split_once(" -->").expect("the comment ends");
        let (_, after) = rest.split_once(END).expect("the table ends");
        let places: Vec<&str> = list.split(", ").collect();
        text.push_str(&format!("{START}{list} -->\n\n{}\n{END}{after}", table(&places)));
        covered.extend(places.into_iter().map(str::to_owned));
    }
    (text, covered)
}

#[test]
fn the_tables_of_the_reference_are_those_of_the_language() {
    let reference = reference();
    let (generated, covered) = generated(&reference);
    for (place, _) in places() {
        assert!(
            covered.iter().any(|covered| covered == place),
            "the reference has no table of the words of {place}"
        );
    }
    if std::env::var_os("UPDATE_REFERENCE").is_some() {
        std::fs::write(PATH, &generated).unwrap_or_else(|error| panic!("{PATH}: {error}"));
    } else {
        assert!(reference == generated, "run this test with UPDATE_REFERENCE=1, and read what has changed");
    }
}

#[test]
fn every_number_has_an_example_that_it_takes() {
    for word in places().into_iter().flat_map(|(_, words)| words) {
        let dimension = match word.value {
            Value::Number(measure, _) => match measure.in_joint(Some(JointKind::Revolute)) {
                Some((dimension, _)) => dimension,
                None => continue,
            },
            Value::Count { .. } => Dimension::NONE,
            Value::Other => continue,
        };
        let example: Quantity = Quantity::parse.parse_str(word.number()).expect("it is a number");
        assert_eq!(example.dimension, dimension, "the example of `{}`", word.text);
    }
}

#[test]
fn every_robot_of_the_reference_verifies() {
    let mut robots = 0;
    for block in reference().split("```").skip(1).step_by(2) {
        // Hidden lines are compiled as well; here they are only the robots.
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
    let estimator = robot.estimators.at(0);
    assert_eq!((estimator.timing.recover_after, estimator.timing.latency_budget_s), (1, None));
    assert_eq!((estimator.timing.lost_after_s, estimator.worker.is_none()), (None, true));
    let command = robot.commands.at(0);
    assert_eq!(
        (command.timeout_s, command.category.number(), &command.cancel),
        (None, 0, &crate::model::Cancel::Nothing)
    );
    assert_eq!(
        (robot.categories.at(0).concurrency, robot.categories.at(0).name.to_string()),
        (1, "default".to_owned())
    );
}
