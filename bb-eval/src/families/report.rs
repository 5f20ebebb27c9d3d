//! The printed table of families.

use super::list::{Family, Half, Measure};
use super::scored::FamilyScore;
use super::{REFERENCE, Share};
use crate::score::Degrees;
use crate::table::aligned;
use serde::Serialize;

const COLUMNS: usize = 15;

const HEAD: [&str; COLUMNS] = [
    "family",
    "filter",
    "trials",
    "total",
    "heading",
    "inclination",
    "worst",
    "/vqf",
    "heading/vqf",
    "incl./vqf",
    "heading in 2σ",
    "tilt in 2σ",
    "median σ",
    "σ/error",
    "ns/vqf",
];

/// A line per family: name, half, the angle that counts, and a description.
pub fn families_list(families: &[&Family]) -> String {
    let half = |family: &Family| family.half.map_or("-", Half::name).to_owned();
    let line =
        |family: &&Family| [family.name.into(), half(family), family.measure.name().into(), family.about.into()];
    let head = ["family", "half", "what counts", "what it is"].map(String::from);
    let lines: Vec<[String; 4]> = [head].into_iter().chain(families.iter().map(line)).collect();
    aligned(&lines, 4, lines.len())
}

/// One object of `--json`.
#[derive(Serialize)]
struct Row {
    family: &'static str,
    half: Option<&'static str>,
    filter: &'static str,
    trials: usize,
    total_deg: f64,
    heading_deg: f64,
    inclination_deg: f64,
    worst_deg: f64,
    /// The angle that counts in the family, over that of VQF.
    ratio: f64,
    heading_within_two_sigma: Option<f64>,
    tilt_within_two_sigma: Option<f64>,
    median_heading_sigma_deg: Option<f64>,
    ns_ratio: f64,
}

/// A JSON array with an object per family and filter.
///
/// # Errors
/// It cannot be written as JSON.
pub fn families_json(scores: &[FamilyScore]) -> Result<String, String> {
    let rows: Vec<_> = scores.iter().filter_map(|score| row(score, scores)).collect();
    let text = serde_json::to_string_pretty(&rows).map_err(|error| error.to_string())?;
    Ok(text + "\n")
}

fn row(score: &FamilyScore, scores: &[FamilyScore]) -> Option<Row> {
    let averages = score.averages()?;
    let reference = reference(score, scores);
    Some(Row {
        family: score.family.name,
        half: score.family.half.map(Half::name),
        filter: score.filter,
        trials: averages.count,
        total_deg: averages.mean.total,
        heading_deg: averages.mean.heading,
        inclination_deg: averages.mean.inclination,
        worst_deg: score.family.measure.of(&averages.worst),
        ratio: reference.map_or(f64::NAN, |reference| score.measured() / reference.measured()),
        heading_within_two_sigma: score.heading.fraction(),
        tilt_within_two_sigma: score.tilt.fraction(),
        median_heading_sigma_deg: score.median_deviation(),
        ns_ratio: reference.map_or(f64::NAN, |reference| score.ns_per_update() / reference.ns_per_update()),
    })
}

/// VQF in the same family.
fn reference<'a>(score: &FamilyScore, scores: &'a [FamilyScore]) -> Option<&'a FamilyScore> {
    scores.iter().find(|other| other.family.name == score.family.name && other.filter == REFERENCE)
}

/// A line per family and filter, then for each filter the geometric mean of the ratios to VQF over the families of each
/// half and over all.
pub fn families_table(scores: &[FamilyScore]) -> String {
    let mut lines: Vec<[String; COLUMNS]> = Vec::new();
    lines.push(HEAD.map(String::from));
    for score in scores {
        let Some(averages) = score.averages() else { continue };
        let reference = reference(score, scores);
        let beside = reference.and_then(FamilyScore::averages);
        let ratio = |of: fn(&Degrees) -> f64| {
            beside.map_or_else(dash, |beside| format!("{:.2}", of(&averages.mean) / of(&beside.mean)))
        };
        let median = score.median_deviation();
        let cost = reference.map(|reference| score.ns_per_update() / reference.ns_per_update());
        lines.push([
            score.family.name.into(),
            score.filter.into(),
            averages.count.to_string(),
            format!("{:.2}", averages.mean.total),
            format!("{:.2}", averages.mean.heading),
            format!("{:.2}", averages.mean.inclination),
            format!("{:.1}", score.family.measure.of(&averages.worst)),
            reference.map_or_else(dash, |reference| format!("{:.3}", score.measured() / reference.measured())),
            ratio(|errors| errors.heading),
            ratio(|errors| errors.inclination),
            percent(score.heading),
            percent(score.tilt),
            median.map_or_else(dash, |median| format!("{median:.2}")),
            median.map_or_else(dash, |median| format!("{:.2}", median / averages.mean.heading)),
            cost.map_or_else(dash, |cost| format!("{cost:.2}")),
        ]);
    }
    let rows = lines.len();
    let mut filters: Vec<&str> = Vec::new();
    for score in scores.iter().filter(|score| score.filter != REFERENCE) {
        if !filters.contains(&score.filter) {
            filters.push(score.filter);
        }
    }
    for filter in filters {
        for half in [Some(Half::A), Some(Half::B), None] {
            let is_asked = |score: &&FamilyScore| {
                let of_half = score.family.half.filter(|of| half.is_none_or(|half| half == *of));
                score.filter == filter && of_half.is_some()
            };
            let of = scores.iter().filter(is_asked);
            let logs: Vec<_> = of
                .filter_map(|score| Some((score.measured() / reference(score, scores)?.measured()).ln()))
                .collect();
            if logs.is_empty() {
                continue;
            }
            let mean = (logs.iter().sum::<f64>() / logs.len() as f64).exp();
            let name = half.map_or_else(|| "both halves".to_owned(), |half| format!("half {}", half.name()));
            let mut line: [String; COLUMNS] = std::array::from_fn(|_| String::new());
            line[0] = name;
            line[1] = filter.into();
            line[2] = logs.len().to_string();
            line[7] = format!("{mean:.3}");
            lines.push(line);
        }
    }
    aligned(&lines, 2, rows)
}

fn dash() -> String {
    "-".into()
}

fn percent(share: Share) -> String {
    share.fraction().map_or_else(dash, |fraction| format!("{:.1} %", 100.0 * fraction))
}

impl Measure {
    /// Name in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Total => "total",
            Self::Drift => "heading",
            Self::Inclination => "inclination",
        }
    }
}

impl Half {
    /// Letter of the half.
    pub fn name(self) -> &'static str {
        match self {
            Self::A => "A",
            Self::B => "B",
        }
    }
}
