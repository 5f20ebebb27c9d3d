//! On the recordings of real sensors, where they are at hand beside the workspace.

mod common;

use common::bb;
use serde_json::Value;
use std::path::Path;

#[test]
fn ten_trials() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    if !data.exists() {
        // To the terminal itself: the test harness keeps what a passing test prints.
        use std::io::Write;
        let _ = writeln!(std::io::stderr(), "skipped: there is no ../shared/data beside the workspace");
        return;
    }
    let folder = data.join("broad");
    let folder = folder.to_str().expect("is text");
    let arguments = ["eval", "attitude", folder, "--filter", "madgwick,complementary", "--set", "beta=0.12"];
    let table = bb(&arguments);
    assert_eq!((table.code, &*table.err), (Some(0), ""));
    let json = bb(&[&arguments[..], &["--json"]].concat());
    let rows: Vec<Value> = serde_json::from_str(&json.out).expect("an array");
    assert_eq!(rows.len(), 20);
    // The same figures each time, in the same order.
    let again: Vec<Value> =
        serde_json::from_str(&bb(&[&arguments[..], &["--json"]].concat()).out).expect("an array");
    for (row, again) in rows.iter().zip(&again) {
        for field in ["file", "filter", "total_deg", "heading_deg", "inclination_deg", "samples"] {
            assert_eq!(row[field], again[field]);
        }
    }
    let mean = |filter: &str, field: &str| {
        let of_filter = rows.iter().filter(|row| row["filter"] == filter);
        of_filter.map(|row| row[field].as_f64().expect("a number")).sum::<f64>() / 10.0
    };
    // The published figure of Madgwick with nine axes at this beta is 5.27.
    assert!((mean("madgwick", "total_deg") / 5.27 - 1.0).abs() < 0.05);
    let line = table.out.lines().find(|line| line.starts_with("mean of 10") && line.contains("complementary"));
    let cells: Vec<_> = line.expect("there is one").split_whitespace().collect();
    assert_eq!(cells[4], format!("{:.2}", mean("complementary", "total_deg")));
}
