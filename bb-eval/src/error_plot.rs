//! Plots of attitude filters over time: errors, roll, pitch and yaw beside the truth, and the strength of the field.

use crate::evaluate::Evaluation;
use crate::filters::Axes;
use crate::periods::Periods;
use crate::report::name;
use bb_core::nalgebra::UnitQuaternion;
use bb_plot::{Band, Colour, Line, PALETTE, Panel, Picture, Point};
use std::path::Path;

/// Largest number of panels; most viewers cannot open larger pictures.
const MOST_PANELS: usize = 50;

/// The truth is thick and light, so that it is seen under the estimates.
const TRUTH: Colour = (190, 190, 190);
const TRUTH_WIDTH: u32 = 7;
/// Times without samples, and with a field that differs from its median.
const GAP: Colour = (245, 190, 190);
const DISTURBED: Colour = (255, 236, 200);
/// Times without a reading of the field.
const NO_FIELD: Colour = (225, 225, 240);
/// A field is disturbed if its strength is off by this part, or missing, for this long, s.
const OFF: f64 = 0.15;
const OFF_S: f64 = 0.5;

/// Writes a plot of attitude filters over time: for each recording the errors, one line per filter, then roll, pitch
/// and yaw beside the truth, and the strength of the field. Gaps and disturbed fields are shaded.
///
/// # Errors
/// There are none, too many, or they cannot be written there.
pub fn plot_errors(file: &Path, evaluations: &[Evaluation], axes: Axes) -> Result<(), String> {
    let panels: Vec<_> = evaluations.iter().flat_map(|evaluation| panels(evaluation, evaluations)).collect();
    if panels.is_empty() {
        return Err(format!("{}: not plotted, for no recording has errors", file.display()));
    }
    if panels.len() > MOST_PANELS {
        let count = panels.len();
        return Err(format!(
            "--plot draws at most {MOST_PANELS} panels, and the recordings have {count}; name fewer"
        ));
    }
    let title = format!("{}, {} axes", angle(axes), axes.name());
    Picture { title, panels, panel_size: (1400, 200) }.write(file)
}

fn angle(axes: Axes) -> &'static str {
    match axes {
        Axes::Six => "inclination error",
        Axes::Nine => "total error",
    }
}

fn panels(evaluation: &Evaluation, all: &[Evaluation]) -> Vec<Panel> {
    let Ok(runs) = &evaluation.runs else { return Vec::new() };
    if !runs.iter().any(|run| run.errors.iter().any(|(_, error)| error.is_some())) {
        return Vec::new();
    }
    let bands = bands(evaluation, runs);
    let colour = |index: usize| PALETTE[index % PALETTE.len()];
    let errors = runs.iter().enumerate().map(|(index, run)| Line::peaks(run.filter, colour(index), 1, &run.errors));
    let axis = format!("{} (deg)", angle(evaluation.axes));
    let mut panels =
        vec![Panel::new(axis, errors.collect()).title(name(evaluation, all)).shade(&bands).cut_spikes()];
    // With six axes yaw is relative.
    let names = if evaluation.axes == Axes::Six { &["roll", "pitch"][..] } else { &["roll", "pitch", "yaw"][..] };
    for (component, name) in names.iter().enumerate() {
        let degrees = |turned: &UnitQuaternion<f64>| {
            let (roll, pitch, yaw) = turned.euler_angles();
            [roll, pitch, yaw][component].to_degrees()
        };
        let truth = runs.first().map(|run| {
            let points: Vec<Point> =
                run.estimates.iter().map(|of| (of.time_s, of.truth.as_ref().map(degrees))).collect();
            Line::degrees("truth", TRUTH, TRUTH_WIDTH, &points)
        });
        let estimates = runs.iter().enumerate().map(|(index, run)| {
            let points: Vec<Point> =
                run.estimates.iter().map(|of| (of.time_s, Some(degrees(&of.world_from_body)))).collect();
            Line::degrees(run.filter, colour(index), 1, &points)
        });
        panels
            .push(Panel::new(format!("{name} (deg)"), truth.into_iter().chain(estimates).collect()).shade(&bands));
    }
    if !evaluation.fields.is_empty() {
        let points: Vec<Point> =
            evaluation.fields.iter().map(|(time_s, strength)| (*time_s, Some(strength * 1e6))).collect();
        let lines = vec![Line::new("field", PALETTE[6], 1, &points)];
        panels.push(Panel::new("strength (µT)", lines).shade(&bands).cut_spikes());
    }
    panels
}

/// Gaps, and times in which the strength of the field is not its median.
fn bands(evaluation: &Evaluation, runs: &[crate::Run]) -> Vec<Band> {
    let band = |label: &str, colour, times| Band { label: label.to_owned(), colour, times };
    let mut strengths: Vec<f64> = evaluation.fields.iter().map(|(_, strength)| *strength).collect();
    strengths.sort_by(f64::total_cmp);
    let median = strengths.get(strengths.len() / 2).copied().unwrap_or(0.0);
    let mut disturbed: Vec<(f64, f64)> = Vec::new();
    for (time_s, strength) in &evaluation.fields {
        if (strength - median).abs() <= OFF * median {
            continue;
        }
        match disturbed.last_mut().filter(|(_, end_s)| time_s - *end_s < OFF_S) {
            Some((_, end_s)) => *end_s = *time_s,
            None => disturbed.push((*time_s, *time_s)),
        }
    }
    disturbed.retain(|(from_s, to_s)| to_s - from_s > OFF_S);
    let times = runs.first().map_or(&[][..], |run| &run.errors);
    let read = evaluation.fields.iter().map(|(time_s, _)| *time_s);
    // A field that is read no more is missing to the end.
    let end_s = times.last().map(|(time_s, _)| *time_s).filter(|_| !evaluation.fields.is_empty());
    let silences = read.clone().zip(read.skip(1).chain(end_s)).filter(|(from_s, to_s)| to_s - from_s > OFF_S);
    let stamps: Vec<i64> = times.iter().map(|(time_s, _)| (time_s * 1e9) as i64).collect();
    let gaps = Periods::of(&stamps).map(|periods| periods.gaps).unwrap_or_default();
    let gaps =
        gaps.iter().filter_map(|gap| times.get(gap.after).map(|(from_s, _)| (*from_s, from_s + gap.length_s)));
    let disturbed = disturbed.into_iter().map(|times| band("disturbed field", DISTURBED, times));
    let silences = silences.map(|times| band("no field", NO_FIELD, times));
    disturbed.chain(silences).chain(gaps.map(|times| band("no IMU", GAP, times))).collect()
}
