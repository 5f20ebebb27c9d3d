//! `--plot` of `bb eval navigation`: the track, errors within their bounds, innovations, errors by the age of the anchor.

use super::trace::{Row, Trace};
use bb_estimators::navigation::chi_square::limit;
use bb_plot::{Band, Colour, Line, PALETTE, Panel, Part, Plane, Point, Scale, Sheet};
use std::path::Path;

/// Largest number of panels; most viewers cannot open larger pictures.
const MOST_PANELS: usize = 120;

/// Colour of expected bounds, and of what was refused.
const BOUND: Colour = (150, 150, 150);
/// Colour and width of the truth: light and thick, so that it shows under the estimate.
const TRUTH: Colour = (190, 190, 190);
const TRUTH_WIDTH: u32 = 7;
const REFUSED: Colour = (213, 0, 0);

/// Times without a position, times without the IMU, and states of health, but for the healthy one.
const OUTAGE: Colour = (255, 236, 200);
const GAP: Colour = (245, 190, 190);
const STATES: [(&str, Colour); 3] =
    [("starting", (225, 225, 225)), ("degraded", (225, 238, 250)), ("lost", (200, 205, 240))];

/// The fraction of good innovations within their bound.
const WITHIN: f64 = 0.95;

/// Time without truth beyond which lines are interrupted, s.
const INTERRUPTED_S: f64 = 5.0;

/// The number of bins for errors by the age of the anchor.
const AGES: usize = 20;

/// A filter on a data set.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// Data set and filter.
    pub name: String,
    /// Steps of the filter.
    pub trace: Trace,
}

/// Writes the track, errors within their bounds, innovations, and errors by the age of the anchor.
///
/// # Errors
/// There is nothing to draw, too much, or it cannot be written there.
pub fn plot_navigation(file: &Path, runs: &[Drawn]) -> Result<(), String> {
    let parts: Vec<Part> = runs.iter().flat_map(parts).collect();
    if parts.is_empty() {
        return Err(format!("{}: not plotted, for nothing was estimated", file.display()));
    }
    if parts.len() > MOST_PANELS {
        let (count, runs) = (parts.len(), runs.len());
        return Err(format!("--plot draws at most {MOST_PANELS} panels, and {runs} runs have {count}; name fewer"));
    }
    Sheet { title: "Navigation".into(), parts, panel_size: (1400, 190) }.write(file)
}

fn parts(run: &Drawn) -> Vec<Part> {
    let rows = &run.trace.rows;
    if rows.is_empty() {
        return Vec::new();
    }
    let bands = bands(run);
    let panel = |title: &str, axis: String, lines| Panel::new(axis, lines).title(title).shade(&bands).cut_spikes();
    let mut parts = vec![Part::Plane(track(run), 3)];
    let mut positions = Vec::new();
    if rows.iter().any(|row| row.errors.is_some()) {
        for (index, axis) in ["east", "north", "up"].into_iter().enumerate().take(dimension(&run.trace)) {
            let title = if index == 0 { "error, and three standard deviations" } else { "" };
            let error = |row: &Row| row.errors.map(|errors| errors.position[index]);
            let deviation = |row: &Row| row.errors.map(|errors| errors.covariance[(index, index)].sqrt());
            positions.push(Part::Panel(panel(title, format!("{axis} (m)"), bounded(rows, &error, &deviation))));
        }
    }
    let mut rotations = Vec::new();
    if rows.iter().any(|row| row.errors.is_some_and(|errors| errors.rotation.is_some())) {
        let first = if run.trace.is_planar { 2 } else { 0 };
        for (index, axis) in ["about east", "about north", "heading"].into_iter().enumerate().skip(first) {
            let title = if index == first { "error, and three standard deviations" } else { "" };
            let error = |row: &Row| Some(row.errors?.rotation?[index].to_degrees());
            let deviation =
                |row: &Row| row.errors.map(|errors| errors.covariance[(3 + index, 3 + index)].sqrt().to_degrees());
            rotations.push(Part::Panel(panel(title, format!("{axis} (deg)"), bounded(rows, &error, &deviation))));
        }
    }
    let mut others = Vec::new();
    if !run.trace.innovations.is_empty() {
        let axis = "in standard deviations".into();
        others.push(Part::Panel(panel("innovations of fixes", axis, innovations(&run.trace))));
    }
    let has_ages = rows.iter().any(|row| row.anchor_age_s.is_some() && row.errors.is_some());
    if has_ages {
        others.push(Part::Plane(by_age(rows), 1));
    }
    parts.extend(in_columns(positions, rotations));
    let second = others.split_off(others.len().div_ceil(2));
    parts.extend(in_columns(others, second));
    parts
}

/// Axes of the position that the filter estimates.
fn dimension(trace: &Trace) -> usize {
    if trace.is_planar { 2 } else { 3 }
}

/// Arranges parts in two columns; a part without a neighbour takes the whole width.
fn in_columns(left: Vec<Part>, right: Vec<Part>) -> Vec<Part> {
    let mut right = right.into_iter();
    left.into_iter()
        .map(|left| match right.next() {
            Some(right) => Part::Row(vec![left, right]),
            None => left,
        })
        .collect()
}

/// Outages, gaps and states of health, as far as they are while something is drawn.
fn bands(run: &Drawn) -> Vec<Band> {
    let Trace { rows, health, outages, gaps, .. } = &run.trace;
    let mut bands = Vec::new();
    let (begin_s, end_s) = rows.first().zip(rows.last()).map_or((0.0, 0.0), |(a, b)| (a.time_s, b.time_s));
    let mut shade = |label: &str, colour, (from_s, to_s): (f64, f64)| {
        let times = (from_s.max(begin_s), to_s.min(end_s));
        if times.0 < times.1 {
            bands.push(Band { label: label.to_owned(), colour, times });
        }
    };
    for (index, (from_s, state)) in health.iter().enumerate() {
        let to_s = health.get(index + 1).map_or(end_s, |(to_s, _)| *to_s);
        if let Some((label, colour)) = STATES.into_iter().find(|(name, _)| name == state) {
            shade(label, colour, (*from_s, to_s));
        }
    }
    outages.iter().for_each(|times| shade("no position", OUTAGE, *times));
    gaps.iter().for_each(|times| shade("no IMU", GAP, *times));
    bands
}

fn track(run: &Drawn) -> Plane {
    let rows = &run.trace.rows;
    let truth: Vec<_> =
        rows.iter().filter_map(|row| row.truth).map(|truth| (truth.position.x, truth.position.y)).collect();
    let estimate: Vec<_> = rows.iter().map(|row| (row.position.x, row.position.y)).collect();
    let fixes: Vec<_> = run.trace.fixes.iter().map(|fix| (fix.x, fix.y)).collect();
    Plane {
        title: run.name.clone(),
        x_axis: "east (m)".into(),
        y_axis: "north (m)".into(),
        scale: Scale::Square,
        lines: vec![
            Line::path("truth", TRUTH, TRUTH_WIDTH, &truth),
            Line::path("fixes", PALETTE[3], 3, &fixes),
            Line::path("estimate", PALETTE[0], 1, &estimate),
        ],
    }
}

/// An error and its bound.
fn bounded(
    rows: &[Row],
    error: &dyn Fn(&Row) -> Option<f64>,
    deviation: &dyn Fn(&Row) -> Option<f64>,
) -> Vec<Line> {
    let known: Vec<&Row> = rows.iter().filter(|row| row.errors.is_some()).collect();
    let line = |value: &dyn Fn(&Row) -> Option<f64>| -> Vec<Point> {
        let mut points: Vec<Point> = Vec::with_capacity(known.len());
        for row in &known {
            // The line is interrupted where the truth is missing, but not between its samples.
            if let Some((last_s, _)) = points.last().copied()
                && row.time_s - last_s > INTERRUPTED_S
            {
                points.push((last_s, None));
            }
            points.push((row.time_s, value(row)));
        }
        points
    };
    vec![
        Line::new("+3σ", BOUND, 1, &line(&|row| deviation(row).map(|deviation| 3.0 * deviation))),
        Line::new("-3σ", BOUND, 1, &line(&|row| deviation(row).map(|deviation| -3.0 * deviation))),
        Line::new("error", PALETTE[0], 1, &line(error)),
    ]
}

/// Innovations in standard deviations: the root of their normalised square over their dimension, 1 on average.
fn innovations(trace: &Trace) -> Vec<Line> {
    let dimension = dimension(trace);
    let of = |is_fused: bool| -> Vec<Point> {
        let chosen = trace.innovations.iter().filter(|one| one.is_fused == is_fused);
        chosen.map(|one| (one.time_s, Some((one.nis / dimension as f64).sqrt()))).collect()
    };
    let bound = (limit(dimension, 1.0 - WITHIN) / dimension as f64).sqrt();
    let ends = [trace.innovations.first(), trace.innovations.last()];
    let line: Vec<Point> = ends.into_iter().flatten().map(|one| (one.time_s, Some(bound))).collect();
    vec![
        Line::new("fused", PALETTE[0], 2, &of(true)),
        Line::new("refused", REFUSED, 3, &of(false)),
        Line::new("95 % below", BOUND, 1, &line),
    ]
}

fn by_age(rows: &[Row]) -> Plane {
    let aged = rows.iter().filter_map(|row| Some((row.anchor_age_s?, row.errors?.position.norm())));
    let points: Vec<(f64, f64)> = aged.collect();
    let oldest = points.iter().map(|(age, _)| *age).fold(0.0, f64::max);
    let mut sums = [(0.0, 0_u32); AGES];
    for (age, error) in &points {
        let step = if oldest > 0.0 { (age / oldest * AGES as f64) as usize } else { 0 };
        let sum = &mut sums[step.min(AGES - 1)];
        *sum = (sum.0 + error * error, sum.1 + 1);
    }
    let middle = |step: usize| oldest * (step as f64 + 0.5) / AGES as f64;
    let filled = sums.iter().enumerate().filter(|(_, (_, count))| *count > 0);
    let means: Vec<_> =
        filled.map(|(step, (sum, count))| (middle(step), (sum / f64::from(*count)).sqrt())).collect();
    Plane {
        title: "error by the age of the last position".into(),
        x_axis: "age (s)".into(),
        y_axis: "position (m)".into(),
        scale: Scale::Linear,
        lines: vec![
            Line::path("instants with truth", PALETTE[5], 2, &points),
            Line::path("root mean square", PALETTE[1], 1, &means),
        ],
    }
}
