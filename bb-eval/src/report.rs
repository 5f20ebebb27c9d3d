//! The printed results.

use crate::averages::Averages;
use crate::evaluate::{Evaluation, Run};
use crate::filters::{Axes, Without};
use crate::score::Degrees;
use crate::table::aligned;
use serde::Serialize;
use std::path::Path;

/// One object of `--json`. Unknown values are null: every error without truth, and with six axes, where only the
/// inclination is scored, total and heading.
#[derive(Serialize)]
struct Row {
    file: String,
    /// Number of the variant, from 0; null if the recording is not modified.
    variant: Option<u32>,
    filter: &'static str,
    axes: &'static str,
    total_deg: Option<f64>,
    heading_deg: Option<f64>,
    inclination_deg: Option<f64>,
    /// The fraction of headings within two of the standard deviations that the filter reported.
    heading_within_two_sigma: Option<f64>,
    /// Share of inclinations within two standard deviations.
    inclination_within_two_sigma: Option<f64>,
    /// 95th percentile and largest total error.
    p95_deg: Option<f64>,
    max_deg: Option<f64>,
    /// Mean normalised error squared; 3 is expected.
    nees: Option<f64>,
    /// The fraction of samples at which the filter trusts its heading, and the error of the heading there.
    heading_trusted: Option<f64>,
    heading_while_trusted_deg: Option<f64>,
    /// Drift of the heading, with six axes too.
    heading_drift_deg_per_min: Option<f64>,
    /// The error while the field was withheld by `--outage`: the total one.
    outage_deg: Option<f64>,
    /// The number of scored samples.
    samples: u64,
    ns_per_update: f64,
}

/// A JSON array with one object per recording and filter.
///
/// # Errors
/// It cannot be written as JSON.
pub fn json(evaluations: &[Evaluation]) -> Result<String, String> {
    let row = |evaluation: &Evaluation, run: &Run| {
        let (rms, axes) = (run.score.rms(), evaluation.axes);
        let whole = rms.filter(|_| axes == Axes::Nine);
        Row {
            file: evaluation.file.display().to_string(),
            variant: evaluation.variant,
            filter: run.filter,
            axes: axes.name(),
            total_deg: whole.map(|rms| rms.total),
            heading_deg: whole.map(|rms| rms.heading),
            inclination_deg: rms.map(|rms| rms.inclination),
            heading_within_two_sigma: within(&[run], axes),
            inclination_within_two_sigma: run.detail.tilt_within.share(),
            p95_deg: run.detail.p95_deg().filter(|_| axes == Axes::Nine),
            max_deg: run.detail.largest().map(|error| match axes {
                Axes::Nine => error.total.to_degrees(),
                Axes::Six => error.inclination.to_degrees(),
            }),
            nees: run.detail.nees().filter(|_| axes == Axes::Nine),
            heading_trusted: run.detail.trusted.share(),
            heading_while_trusted_deg: run.detail.heading_while_trusted_deg(),
            heading_drift_deg_per_min: run.detail.drift_deg_per_min(),
            outage_deg: run.outage.rms().map(|rms| rms.total),
            samples: run.score.count(),
            ns_per_update: run.ns_per_update,
        }
    };
    let rows: Vec<_> = runs(evaluations).map(|(evaluation, run)| row(evaluation, run)).collect();
    let text = serde_json::to_string_pretty(&rows).map_err(|error| error.to_string())?;
    Ok(text + "\n")
}

/// One line per recording and filter, then the averages of each filter.
pub fn table(evaluations: &[Evaluation], axes: Axes) -> String {
    let is_asked = |evaluation: &Evaluation| evaluation.axes == axes;
    // Six, if no recording has nine.
    let axes = if runs(evaluations).any(|(evaluation, _)| is_asked(evaluation)) { axes } else { Axes::Six };
    let mut lines: Vec<[String; 13]> = Vec::new();
    for (evaluation, run) in runs(evaluations) {
        let [total, heading, inclination] = angles(run.score.rms(), evaluation.axes);
        let cost = format!("{:.0}", run.ns_per_update);
        let count = run.score.count().to_string();
        lines.push([
            name(evaluation, evaluations),
            run.filter.into(),
            total,
            heading,
            inclination,
            percent(within(&[run], evaluation.axes)),
            percent(run.detail.tilt_within.share()),
            two(run.detail.largest().map(|error| match evaluation.axes {
                Axes::Nine => error.total.to_degrees(),
                Axes::Six => error.inclination.to_degrees(),
            })),
            run.detail
                .nees()
                .filter(|_| evaluation.axes == Axes::Nine)
                .map_or_else(|| "-".into(), |nees| format!("{nees:.1}")),
            percent(run.detail.trusted.share()),
            two(run.detail.drift_deg_per_min()),
            count,
            cost,
        ]);
    }
    if lines.is_empty() {
        return String::new();
    }
    let rows = lines.len();
    let mut filters: Vec<&str> = Vec::new();
    for (_, run) in runs(evaluations) {
        if !filters.contains(&run.filter) {
            filters.push(run.filter);
        }
    }
    for filter in filters {
        let of_filter =
            runs(evaluations).filter(|(evaluation, run)| run.filter == filter && evaluation.axes == axes);
        let all: Vec<_> = of_filter.clone().map(|(_, run)| run).collect();
        let share = percent(within(&all, axes));
        let Some(averages) = Averages::of(of_filter.filter_map(|(_, run)| run.score.rms())) else { continue };
        // The average of a single recording adds nothing.
        if averages.count < 2 {
            continue;
        }
        for (what, score) in [("mean of", averages.mean), ("worst of", averages.worst)] {
            let [total, heading, inclination] = angles(Some(score), axes);
            let what = format!("{what} {}", averages.count);
            let share = if what.starts_with("mean") { share.clone() } else { String::new() };
            let mut line = [const { String::new() }; 13];
            for (cell, text) in line.iter_mut().zip([what, filter.into(), total, heading, inclination, share]) {
                *cell = text;
            }
            lines.push(line);
        }
    }
    let head = [
        "recording",
        "filter",
        "total",
        "heading",
        "inclination",
        "in 2σ",
        "incl. in 2σ",
        "max",
        "NEES",
        "trusted",
        "drift/min",
        "samples",
        "ns/update",
    ];
    lines.insert(0, head.map(String::from));
    let mut text = format!("Error against the truth, {} axes, RMS in degrees:\n\n", axes.name());
    text += &aligned(&lines, 2, rows + 1);
    text
}

/// Prints remarks on the runs, then errors, to the error stream; returns whether there were no errors. A setting without which
/// all recordings give the same is an error.
pub fn complain(evaluations: &[Evaluation], without: &[Without]) -> bool {
    for evaluation in evaluations {
        for note in &evaluation.notes {
            eprintln!("note: {}: {note}", evaluation.file.display());
        }
    }
    let mut bad = 0;
    for evaluation in evaluations {
        let file = evaluation.file.display();
        match (&evaluation.runs, &evaluation.broken) {
            (Err(fault), _) => eprintln!("error: {file}: {fault}"),
            (Ok(_), Some(fault)) => eprintln!("error: {file}: {fault}; scored up to there"),
            (Ok(_), None) => continue,
        }
        bad += 1;
    }
    if bad > 0 && evaluations.len() > 1 {
        eprintln!("error: {bad} of {} recordings could not be evaluated to the end", evaluations.len());
    }
    let scored: Vec<_> = evaluations.iter().filter(|evaluation| evaluation.runs.is_ok()).collect();
    let is_idle = |place: usize| scored.iter().all(|evaluation| evaluation.idle.contains(&place));
    let idle: Vec<_> = without.iter().enumerate().filter(|(place, _)| is_idle(*place)).collect();
    // A setting of several filters is one.
    let is_all_idle = |setting: &str| {
        let all = without.iter().filter(|other| other.setting == setting).count();
        idle.iter().filter(|(_, other)| other.setting == setting).count() == all
    };
    let mut named: Vec<&str> = Vec::new();
    for (_, Without { setting, .. }) in idle.iter().filter(|_| !scored.is_empty()) {
        if is_all_idle(setting) && !named.contains(&&**setting) {
            eprintln!("error: {setting} changes nothing on these recordings");
            named.push(setting);
        }
    }
    bad == 0 && named.is_empty()
}

/// The fraction of headings within two standard deviations; `None` if no filter reports them.
fn within(runs: &[&Run], axes: Axes) -> Option<f64> {
    let (known, within) = runs
        .iter()
        .map(|run| run.detail.heading_within)
        .fold((0, 0), |sum, share| (sum.0 + share.all, sum.1 + share.part));
    (known > 0 && axes == Axes::Nine).then(|| within as f64 / known as f64)
}

fn two(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.2}"))
}

fn percent(share: Option<f64>) -> String {
    share.map_or_else(|| "-".to_owned(), |share| format!("{:.0} %", 100.0 * share))
}

fn runs(evaluations: &[Evaluation]) -> impl Clone + Iterator<Item = (&Evaluation, &Run)> {
    evaluations.iter().flat_map(|evaluation| evaluation.runs.iter().flatten().map(move |run| (evaluation, run)))
}

/// The name of a recording in a table or a picture: without folder and extension if that is unambiguous.
pub(crate) fn name(evaluation: &Evaluation, evaluations: &[Evaluation]) -> String {
    let file: &Path = &evaluation.file;
    // Variants of one recording are named by their number.
    let is_alike =
        |other: &&Evaluation| other.file.file_stem() == file.file_stem() && other.variant == evaluation.variant;
    let alike = evaluations.iter().filter(is_alike).count();
    let short = file.file_stem().filter(|_| alike == 1);
    let name = short.unwrap_or(file.as_os_str()).to_string_lossy();
    evaluation.variant.map_or_else(|| name.clone().into_owned(), |variant| format!("{name} #{variant}"))
}

/// Writes the angles; with six axes only the inclination, since the initial heading is arbitrary.
fn angles(rms: Option<Degrees>, axes: Axes) -> [String; 3] {
    let angle = |angle: f64| format!("{angle:.2}");
    let none = || "-".to_owned();
    match (rms, axes) {
        (None, _) => [none(), none(), none()],
        (Some(rms), Axes::Six) => [none(), none(), angle(rms.inclination)],
        (Some(rms), Axes::Nine) => [angle(rms.total), angle(rms.heading), angle(rms.inclination)],
    }
}
