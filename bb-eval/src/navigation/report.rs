//! The output of `bb eval navigation`.

use super::evaluate::NavigationScore;
use serde::Serialize;
use std::fmt::Write;
use std::path::PathBuf;

/// A data set, a filter's name, and its score.
pub type ScoredNavigation = (PathBuf, &'static str, NavigationScore);

/// One object of `--json`; values missing in the truth are null.
#[derive(Serialize)]
struct Object {
    file: String,
    filter: &'static str,
    position_rmse_m: Option<f64>,
    orientation_rmse_deg: Option<f64>,
    velocity_rmse_mps: Option<f64>,
    nees: Option<f64>,
    keyframes: usize,
    position_smoothed_rmse_m: Option<f64>,
    orientation_smoothed_rmse_deg: Option<f64>,
    us_per_imu_sample: f64,
    ms_per_keyframe_p50: f64,
    ms_per_keyframe_p99: f64,
    refused: u64,
    allocations: Option<u64>,
    rss_mb: Option<f64>,
}

/// What is NaN without truth.
fn known(value: f64) -> Option<f64> {
    Some(value).filter(|value| value.is_finite())
}

/// A JSON array with one object per data set and filter.
///
/// # Errors
/// It cannot be written as JSON.
pub fn navigation_json(scores: &[ScoredNavigation]) -> Result<String, String> {
    let object = |(file, filter, score): &ScoredNavigation| Object {
        file: file.display().to_string(),
        filter,
        position_rmse_m: known(score.position_rmse_m),
        orientation_rmse_deg: score.orientation_rmse_deg,
        velocity_rmse_mps: score.velocity_rmse_mps,
        nees: known(score.nees),
        keyframes: score.keyframes,
        position_smoothed_rmse_m: score.position_smoothed_rmse_m,
        orientation_smoothed_rmse_deg: score.orientation_smoothed_rmse_deg,
        us_per_imu_sample: score.us_per_imu_sample,
        ms_per_keyframe_p50: score.ms_per_keyframe_p50,
        ms_per_keyframe_p99: score.ms_per_keyframe_p99,
        refused: score.refused,
        allocations: score.allocations,
        rss_mb: score.rss_mb,
    };
    let objects: Vec<_> = scores.iter().map(object).collect();
    Ok(serde_json::to_string_pretty(&objects).map_err(|error| error.to_string())? + "\n")
}

/// One line per data set and filter; empty if there are none.
pub fn navigation_table(scores: &[ScoredNavigation]) -> String {
    if scores.is_empty() {
        return String::new();
    }
    let name = |file: &PathBuf| file.file_name().unwrap_or(file.as_os_str()).to_string_lossy().into_owned();
    let width = scores.iter().map(|(file, ..)| name(file).chars().count()).max().unwrap_or(0).max(4);
    let mut text = String::from("Root mean square errors at the keyframes:\n\n");
    let head =
        ["position m", "orient. deg", "velocity m/s", "NEES", "keyframes", "us/sample", "ms/keyframe", "99 %"];
    let _ = write!(text, "{:width$}  {:15}", "data", "filter");
    for cell in head {
        let _ = write!(text, "  {cell:>12}");
    }
    text.push('\n');
    for (file, filter, score) in scores {
        let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.3}"));
        let cells = [
            number(known(score.position_rmse_m)),
            number(score.orientation_rmse_deg),
            number(score.velocity_rmse_mps),
            known(score.nees).map_or_else(|| "-".to_owned(), |nees| format!("{nees:.2}")),
            score.keyframes.to_string(),
            format!("{:.2}", score.us_per_imu_sample),
            format!("{:.4}", score.ms_per_keyframe_p50),
            format!("{:.4}", score.ms_per_keyframe_p99),
        ];
        let _ = write!(text, "{:width$}  {filter:15}", name(file));
        for cell in cells {
            let _ = write!(text, "  {cell:>12}");
        }
        text.push('\n');
    }
    text
}
