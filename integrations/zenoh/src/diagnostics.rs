//! The problems of a robot, as `/diagnostics` has it.

use crate::messages::{DiagnosticArray, DiagnosticStatus, KeyValue};
use bb_core::message::codec::ros::{Byte, Header, Time};
use serde_json::Value;

const OK: Byte = Byte(0);
const WARN: Byte = Byte(1);
const ERROR: Byte = Byte(2);

/// The diagnosis of a report in JSON: of the robot, of each problem, and of each estimator that has none.
///
/// # Errors
/// The text is not JSON.
pub(crate) fn diagnostics(robot: &str, report: &str, stamp: Time) -> Result<DiagnosticArray, serde_json::Error> {
    let report: Value = serde_json::from_str(report)?;
    let text = |value: &Value, name: &str| value.get(name).and_then(Value::as_str).unwrap_or_default().to_owned();
    let list = |name: &str| report.get(name).and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
    let status = |level: Byte, path: &str, message: String, values: Vec<KeyValue>| DiagnosticStatus {
        level,
        name: if path.is_empty() { robot.to_owned() } else { format!("{robot}: {path}") },
        message,
        hardware_id: robot.to_owned(),
        values,
    };
    let value = |of: &Value, key: &str| {
        let value = match of.get(key)? {
            Value::Null => return None,
            Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        Some(KeyValue { key: key.to_owned(), value })
    };
    let problems = list("problems").iter().map(|problem| {
        let level = match text(problem, "severity").as_str() {
            "degraded" | "refused" => WARN,
            _ => ERROR,
        };
        let values = ["severity", "since"].into_iter().filter_map(|key| value(problem, key)).collect();
        status(level, &text(problem, "path"), text(problem, "reason"), values)
    });
    let problems: Vec<DiagnosticStatus> = problems.collect();
    let worst = problems.iter().map(|problem| problem.level).max_by_key(|level| level.0).unwrap_or(OK);
    let message = match problems.first() {
        None => text(&report, "state"),
        Some(first) => format!("{}: {}", first.name, first.message),
    };
    let values = ["safety", "state", "time"].into_iter().filter_map(|key| value(&report, key)).collect();
    let whole = status(worst, "", message, values);
    let healthy = list("estimators").iter().map(|estimator| {
        let values = ["dispatched", "emitted", "restarts"].into_iter().filter_map(|key| value(estimator, key));
        status(OK, &text(estimator, "path"), text(estimator, "health"), values.collect())
    });
    let healthy: Vec<_> =
        healthy.filter(|status| problems.iter().all(|problem| problem.name != status.name)).collect();
    let status = std::iter::once(whole).chain(problems).chain(healthy).collect();
    Ok(DiagnosticArray { header: Header { stamp, frame_id: String::new() }, status })
}
