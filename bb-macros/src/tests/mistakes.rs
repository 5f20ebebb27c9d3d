//! Mistakes by people who know another language or another tool: each robot with the errors it gets.
//!
//! `mistakes/mistakes.txt` is the table: after `===` a description of the mistake, then the robot, and after `---`
//! its errors as `line:column text | message`. `UPDATE_MISTAKES=1 cargo test -p bb-macros mistakes` rewrites the
//! errors; read them as the author of the mistake would.

use super::{diagnostics, tokens};
use crate::diagnostics::Diagnostic;

const TABLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/src/tests/mistakes/mistakes.txt");

struct Mistake {
    title: String,
    robot: String,
    errors: String,
}

fn mistakes(table: &str) -> Vec<Mistake> {
    let mistake = |text: &str| {
        let (title, rest) = text.split_once('\n').expect("a title");
        let (robot, errors) = rest.split_once("\n---\n").expect("a robot, and its errors");
        Mistake { title: title.to_owned(), robot: robot.to_owned(), errors: errors.trim().to_owned() }
    };
    table.split("=== ").skip(1).map(mistake).collect()
}

/// `2:10 imu | what is wrong`, one line each.
fn errors(robot: &str) -> String {
    let line = |Diagnostic { place, message }: Diagnostic| {
        let (start, under) = (place.start.start(), place.start.byte_range().start..place.end.byte_range().end);
        let under = robot.get(under).unwrap_or("").split_whitespace().collect::<Vec<_>>().join(" ");
        format!("{}:{} {under} | {message}", start.line, start.column + 1)
    };
    diagnostics(tokens(robot)).into_iter().map(line).collect::<Vec<_>>().join("\n")
}

#[test]
fn mistakes_get_the_errors_of_the_table() {
    let table = std::fs::read_to_string(TABLE).expect("it is beside");
    let mistakes = mistakes(&table);
    let written =
        |Mistake { title, robot, .. }: &Mistake| format!("=== {title}\n{robot}\n---\n{}\n\n", errors(robot));
    if std::env::var_os("UPDATE_MISTAKES").is_some() {
        std::fs::write(TABLE, mistakes.iter().map(written).collect::<String>()).expect("it is beside");
        return;
    }
    for Mistake { title, robot, errors: expected } in &mistakes {
        assert_eq!(errors(robot), *expected, "{title}:\n{robot}");
    }
}
