//! Descriptions of filters and their parameters for `--help` and `--list`.

use super::MAGNETOMETER;
use bb_estimators::attitude::FilterParams;
use bb_estimators::params::{Kind, Params, Value};
use std::fmt::Write;

/// Each filter with its purpose, for `--help`.
pub fn described() -> String {
    let mut text = String::from("The filters, or `all`: several with commas. --list prints their parameters.\n");
    for params in FilterParams::ALL.iter().map(|default| default()) {
        let _ = write!(text, "\n{}: {}", params.name(), params.about().when);
    }
    text
}

/// The parameters of filters, for `--list`: name, default, range, unit and description.
pub fn listed(filters: &[FilterParams]) -> String {
    let mut text = String::new();
    for filter in filters {
        let about = filter.about();
        let separator = if text.is_empty() { "" } else { "\n" };
        let _ = writeln!(text, "{separator}{}: {}\n  {}", filter.name(), about.when, about.idea);
        text +=
            &parameters(filter, |name| name != MAGNETOMETER || matches!(filter.get(name), Some(Value::Choice(_))));
    }
    text
}

/// The parameters of one algorithm whose names are requested.
pub fn parameters(params: &dyn Params, is_asked: impl Fn(&str) -> bool) -> String {
    let mut text = String::new();
    let rows = params.parameters().iter().filter(|row| is_asked(row.name));
    for row in rows {
        let value = params.get(row.name).map(|value| value.to_string()).unwrap_or_default();
        let unit = if row.unit.is_empty() { String::new() } else { format!(" {}", row.unit) };
        let range = match row.kind {
            Kind::Number | Kind::Process => format!(", {}{unit}", row.range),
            Kind::Choice(names) => format!(", of {}", names.join(", ")),
            Kind::Switch | Kind::Count => String::new(),
        };
        let unit = if row.kind == Kind::Number { &*unit } else { "" };
        let _ = writeln!(text, "\n  {} = {value}{unit}{range}", row.name);
        for line in row.summary().lines() {
            let _ = writeln!(text, "      {}", line.trim());
        }
    }
    text
}
