//! The output of `bb eval navigation`.

use super::score::{NavigationScore, Spread};
use crate::table::{aligned, counted};
use serde::Serialize;
use std::fmt::Write;
use std::path::PathBuf;

/// A bag, a filter's name, and its score.
pub type ScoredNavigation = (PathBuf, &'static str, NavigationScore);

#[derive(Serialize)]
struct Object<'a> {
    file: String,
    filter: &'static str,
    #[serde(flatten)]
    score: &'a NavigationScore,
}

/// A JSON array with one object per bag and filter.
///
/// # Errors
/// It cannot be written as JSON.
pub fn navigation_json(scores: &[ScoredNavigation]) -> Result<String, String> {
    let object = |(file, filter, score): &'_ ScoredNavigation| (file.display().to_string(), *filter, score.clone());
    let owned: Vec<_> = scores.iter().map(object).collect();
    let objects: Vec<_> =
        owned.iter().map(|(file, filter, score)| Object { file: file.clone(), filter, score }).collect();
    Ok(serde_json::to_string_pretty(&objects).map_err(|error| error.to_string())? + "\n")
}

/// A line per bag and filter, then how each filter fared; empty without any.
pub fn navigation_table(scores: &[ScoredNavigation]) -> String {
    if scores.is_empty() {
        return String::new();
    }
    let name = |file: &PathBuf| file.file_name().unwrap_or(file.as_os_str()).to_string_lossy().into_owned();
    let rms = |spread: Option<Spread>| spread.map_or_else(|| "-".to_owned(), |spread| number(spread.rms));
    let part = |share: Option<f64>| share.map_or_else(|| "-".to_owned(), |share| format!("{:.0} %", 100.0 * share));
    let head = [
        "recording",
        "filter",
        "position m",
        "horizontal",
        "95 %",
        "max",
        "vertical",
        "heading deg",
        "tilt",
        "m/s",
        "NEES",
        "in 2σ",
        "heading in 2σ",
        "scored",
    ];
    let mut rows = vec![head.map(String::from)];
    for (file, filter, score) in scores {
        let of = |of: fn(&Spread) -> f64| {
            score.horizontal_m.as_ref().map_or("-".to_owned(), |spread| number(of(spread)))
        };
        rows.push([
            name(file),
            (*filter).to_owned(),
            rms(score.position_m),
            rms(score.horizontal_m),
            of(|spread| spread.p95),
            of(|spread| spread.max),
            rms(score.vertical_m),
            rms(score.heading_deg),
            rms(score.tilt_deg),
            rms(score.velocity_mps),
            score.nees.map_or_else(|| "-".to_owned(), |nees| format!("{nees:.1}/{}", score.nees_expected)),
            part(score.within.position),
            part(score.within.heading),
            score.scored.to_string(),
        ]);
    }
    let mut text = String::from("Errors against the truth, RMS; NEES beside what is expected:\n\n");
    text += &aligned(&rows, 2, rows.len());
    for (file, filter, score) in scores {
        let _ = write!(text, "\n{}, {filter}:\n{}", name(file), fared(score));
    }
    text
}

/// A number with three digits.
fn number(value: f64) -> String {
    match value.abs() {
        ..10.0 => format!("{value:.3}"),
        10.0..100.0 => format!("{value:.2}"),
        100.0..1000.0 => format!("{value:.1}"),
        _ => format!("{value:.0}"),
    }
}

/// Lines on how a filter fared: its states, what was wrong, outages, and what was refused.
fn fared(score: &NavigationScore) -> String {
    let mut text = String::new();
    let _ = writeln!(
        text,
        "  first estimate after {:.1} s; {:.2} us a sample",
        score.started_s, score.us_per_imu_sample
    );
    for state in &score.states {
        let _ = write!(text, "  {} for {:.1} s", state.state, state.seconds);
        if let Some(position) = state.position_m {
            let _ = write!(text, ": position {} m, at most {}", number(position.rms), number(position.max));
        }
        if let Some(heading) = state.heading_deg {
            let _ = write!(text, "; heading {} deg, at most {}", number(heading.rms), number(heading.max));
        }
        text.push('\n');
    }
    for wrong in &score.wrong {
        let _ = writeln!(text, "  {}: {:.1} s", wrong.reason, wrong.seconds);
    }
    for age in &score.ages {
        let to = age.to_s.map_or_else(|| "and more".to_owned(), |to| format!("to {to} s"));
        let Spread { rms, max, .. } = age.horizontal_m;
        let _ = writeln!(
            text,
            "  {} s {to} without a position: horizontal {} m, at most {} ({})",
            age.from_s,
            number(rms),
            number(max),
            age.count
        );
    }
    for fate in &score.fates {
        let _ = write!(text, "  {}: {} fused, {} refused", fate.input, fate.fused, fate.refused);
        text += &if fate.unused > 0 { format!(", {} not used\n", fate.unused) } else { "\n".to_owned() };
    }
    if score.resets > 0 {
        let _ = writeln!(text, "  begun again elsewhere {} times", score.resets);
    }
    if score.gaps > 0 {
        let _ = writeln!(text, "  {} in the samples of the IMU", counted(score.gaps, "gap", "gaps"));
    }
    if score.silent > 0 {
        let _ = writeln!(text, "  no estimate at {} instants with truth", score.silent);
    }
    text
}
