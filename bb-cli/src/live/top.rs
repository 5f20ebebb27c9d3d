//! `bb top`: what is wrong with a running robot, its health, its topics and what runs, on one screen.

use super::{Live, command::progress, topic::rates};
use crate::say;
use clap::Args;
use serde_json::Value;
use std::collections::{BTreeMap, VecDeque};
use std::io::IsTerminal;
use std::process::{Command, Stdio};

/// Rates are those of the last seconds.
const SPAN_S: f64 = 2.0;
/// Clears the terminal.
const CLEAR: &str = "\x1b[H\x1b[2J";

/// Shows what is wrong with a running robot and since when, health, rates, latencies and drops, on one screen.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    live: Live,
    /// Prints one screen and ends, as it does if the output is not a terminal.
    #[arg(long)]
    once: bool,
    /// Columns; by default those of the terminal.
    #[arg(long, value_name = "N")]
    width: Option<usize>,
}

pub(super) fn run(arguments: &Arguments) -> Result<bool, String> {
    let mut robot = arguments.live.connect()?;
    if arguments.live.json {
        let report = robot.report()?;
        return say(&format!("{report}\n"));
    }
    let is_once = arguments.once || !std::io::stdout().is_terminal();
    let mut reports = VecDeque::new();
    loop {
        reports.push_back(robot.report()?);
        let (Some(first), Some(last)) = (reports.front(), reports.back()) else { continue };
        let span = time(last) - time(first);
        // A first screen without rates would be of no use.
        if span < SPAN_S / 2.0 {
            continue;
        }
        let rates: BTreeMap<String, f64> = rates(first, last)
            .filter_map(|(path, messages)| Some((path.as_str()?.to_owned(), messages as f64 / span)))
            .collect();
        let (width, height) = match (arguments.width, is_once) {
            (Some(width), _) => (width, usize::MAX),
            (None, true) => (80, usize::MAX),
            (None, false) => size(),
        };
        let screen = screen(&robot.welcome, last, &rates, width);
        if is_once {
            return say(&screen);
        }
        // The last line would scroll the first one away.
        let shown: Vec<&str> = screen.lines().take(height.saturating_sub(1)).collect();
        if !say(&format!("{CLEAR}{}\n", shown.join("\n")))? {
            return Ok(true);
        }
        while reports.len() > 1 && span > SPAN_S {
            reports.pop_front();
            if reports
                .front()
                .is_some_and(|first| reports.back().is_some_and(|last| time(last) - time(first) <= SPAN_S))
            {
                break;
            }
        }
    }
}

/// Columns and rows of the terminal, as `stty` says.
fn size() -> (usize, usize) {
    let said = Command::new("stty").arg("size").stdin(Stdio::inherit()).output().ok();
    let said = said.and_then(|output| String::from_utf8(output.stdout).ok()).unwrap_or_default();
    let mut numbers = said.split_whitespace().filter_map(|number| number.parse().ok());
    match (numbers.next(), numbers.next()) {
        (Some(rows), Some(columns)) if columns > 0 && rows > 0 => (columns, rows),
        _ => (80, 24),
    }
}

fn time(report: &Value) -> f64 {
    report["time"].as_f64().unwrap_or_default()
}

/// The whole screen; no line is longer than `width`.
fn screen(welcome: &Value, report: &Value, rates: &BTreeMap<String, f64>, width: usize) -> String {
    let now = time(report);
    let text = |value: &Value, name: &str| value[name].as_str().unwrap_or_default().to_owned();
    let list = |name: &str| report[name].as_array().cloned().unwrap_or_default();
    let mut lines = vec![format!(
        "{} ({})   {}   {}   {}",
        text(welcome, "robot"),
        text(&welcome["description"], "run"),
        text(report, "safety"),
        text(report, "state"),
        clock(now)
    )];
    lines.push(String::new());
    let problems = list("problems");
    lines.push(if problems.is_empty() { "nothing is wrong".to_owned() } else { "what is wrong".to_owned() });
    for problem in &problems {
        let since = problem["since"].as_f64().map_or_else(|| "?".to_owned(), |since| span(now - since));
        lines.push(format!("  {:<9}{:>8}  {}", text(problem, "severity"), since, text(problem, "path")));
        lines.extend(
            wrapped(&text(problem, "reason"), width.saturating_sub(21).max(20))
                .map(|line| format!("{:21}{line}", "")),
        );
    }
    let executions = list("executions");
    if !executions.is_empty() {
        lines.push(String::new());
        lines.push("what runs".to_owned());
    }
    for one in &executions {
        let since = span(now - one["started"].as_f64().unwrap_or(now));
        lines.push(format!(
            "  no. {:<5}{:>8}  {}, by {}{}",
            one["number"].to_string(),
            since,
            text(one, "path"),
            text(one, "caller"),
            progress(&one["progress"])
        ));
    }
    let estimators: Vec<Value> = list("estimators").into_iter().filter(|one| !one["health"].is_null()).collect();
    let rate = |path: &str| rates.get(path).map_or_else(|| "-".to_owned(), |rate| format!("{rate:.1}"));
    if !estimators.is_empty() {
        lines.push(String::new());
        let name = width.saturating_sub(46).max(12);
        lines.push(format!(
            "{:<name$} {:>9} {:>7} {:>9} {:>8} {:>8}",
            "estimator", "health", "for", "Hz", "p99", "dropped"
        ));
        for one in &estimators {
            let path = text(one, "path");
            let health = if one["stopped"].is_null() { text(one, "health") } else { "stopped".to_owned() };
            let inputs = one["inputs"].as_array().cloned().unwrap_or_default();
            let dropped: u64 = inputs
                .iter()
                .flat_map(|input| input["dropped"].as_object().cloned().unwrap_or_default())
                .filter_map(|(_, count)| count.as_u64())
                .sum();
            lines.push(format!(
                "{:<name$} {:>9} {:>7} {:>9} {:>8} {:>8}",
                cut(&path, name),
                health,
                span(now - one["since"].as_f64().unwrap_or_default()),
                rate(&path),
                one["latency"]["p99"].as_f64().map_or_else(|| "-".to_owned(), span),
                dropped
            ));
        }
    }
    lines.push(String::new());
    let name = width.saturating_sub(32).max(12);
    lines.push(format!("{:<name$} {:>9} {:>11} {:>9}", "topic", "Hz", "messages", "lost"));
    for topic in list("topics").iter().filter(|topic| topic["published"].as_u64().is_some_and(|count| count > 0)) {
        let path = text(topic, "path");
        lines.push(format!(
            "{:<name$} {:>9} {:>11} {:>9}",
            cut(&path, name),
            rate(&path),
            topic["published"].to_string(),
            topic["lost"].to_string()
        ));
    }
    lines.iter().map(|line| cut(line, width).trim_end().to_owned() + "\n").collect()
}

/// Lines of at most `width` characters, broken between words; three at most.
fn wrapped(text: &str, width: usize) -> impl Iterator<Item = String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let line = lines.last().map_or(0, |line| line.chars().count());
        if line > 0 && line + 1 + word.chars().count() > width {
            lines.push(String::new());
        }
        if let Some(line) = lines.last_mut() {
            let separator = if line.is_empty() { "" } else { " " };
            *line += &format!("{separator}{word}");
        }
    }
    let is_longer = lines.len() > 3;
    lines.truncate(3);
    if let Some(last) = lines.last_mut().filter(|_| is_longer) {
        last.push('…');
    }
    lines.into_iter()
}

/// Cuts a text to `width` characters, the last of which says that there were more.
fn cut(text: &str, width: usize) -> String {
    if text.chars().count() <= width {
        return text.to_owned();
    }
    text.chars().take(width.saturating_sub(1)).chain(['…']).collect()
}

/// A duration in a few characters.
fn span(seconds: f64) -> String {
    match seconds {
        seconds if seconds < 1e-3 => format!("{:.0} us", seconds.max(0.0) * 1e6),
        seconds if seconds < 1.0 => format!("{:.1} ms", seconds * 1e3),
        seconds if seconds < 100.0 => format!("{seconds:.1} s"),
        seconds if seconds < 6000.0 => format!("{:.0} min", (seconds / 60.0).floor()),
        seconds => format!("{:.0} h", (seconds / 3600.0).floor()),
    }
}

/// A run time: `1:02:03`.
fn clock(seconds: f64) -> String {
    let whole = seconds.max(0.0) as u64;
    format!("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// A stored report gives the stored screens.
    #[test]
    fn screens_fit_their_width() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/top");
        let report: Value = serde_json::from_str(include_str!("../../tests/top/report.json")).expect("JSON");
        let welcome = serde_json::json!({"robot": "Rover", "description": {"run": "live"}});
        let rates = [("sensor/base/imu", 199.96), ("estimator/base/pose", 199.96), ("sensor/base/battery", 2.0)];
        let rates: BTreeMap<String, f64> = rates.into_iter().map(|(path, rate)| (path.to_owned(), rate)).collect();
        for width in [80, 120] {
            let screen = screen(&welcome, &report, &rates, width);
            assert!(screen.lines().all(|line| line.chars().count() <= width), "{screen}");
            let stored = folder.join(format!("screen_{width}.txt"));
            if std::env::var_os("UPDATE_TOP").is_some() {
                std::fs::write(&stored, &screen).expect("it is written");
            }
            let expected = std::fs::read_to_string(&stored).expect("it is stored");
            assert_eq!(screen, expected, "read it, then store it with UPDATE_TOP=1");
        }
    }

    #[test]
    fn durations_take_few_characters() {
        let all = [0.0, 1.5e-5, 0.0123, 1.0, 99.94, 100.0, 3599.0, 86400.0].map(span);
        assert_eq!(all, ["0 us", "15 us", "12.3 ms", "1.0 s", "99.9 s", "1 min", "59 min", "24 h"]);
    }
}
