//! Truth and estimate over time, as a picture.

use crate::outcome::{Outcome, Point, Series};
use bb_core::nalgebra::UnitQuaternion;
use bb_estimators::attitude::OrientationError;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};
use std::error::Error;
use std::path::Path;

/// More points than pixels show nothing more.
const MOST_POINTS: usize = 4000;
const TRUTH: RGBColor = RGBColor(250, 170, 60);
const ESTIMATE: RGBColor = RGBColor(0, 80, 170);
const ERROR: RGBColor = RGBColor(210, 50, 30);

/// Roll, pitch and yaw of the first series, then its errors.
pub(crate) fn plot(file: &Path, outcome: &Outcome) -> Result<(), Box<dyn Error>> {
    check(file)?;
    // The font comes along, so that a plot needs nothing of the machine.
    register_font("sans-serif", FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT)
        .map_err(|_| "the plot's font cannot be read")?;
    let Some(series) = outcome.series.first().filter(|series| series.len() > 1) else {
        return Err("there is nothing to plot: no estimate was published".into());
    };
    let root = BitMapBackend::new(file, (1400, 1000)).into_drawing_area();
    root.fill(&WHITE)?;
    let title = format!("{} ({})", series.name, outcome.filter.name());
    let panels = root.titled(&title, ("sans-serif", 24))?.split_evenly((4, 1));
    let angles = ["roll", "pitch", "yaw"];
    for (index, (panel, name)) in panels.iter().zip(angles).enumerate() {
        let angle = |rotation: &UnitQuaternion<f64>| {
            let (roll, pitch, yaw) = rotation.euler_angles();
            [roll, pitch, yaw][index].to_degrees()
        };
        let truth = line(series, |point| point.truth.as_ref().map(angle));
        let estimate = line(series, |point| Some(angle(&point.estimate)));
        panel_of(
            panel,
            name,
            &[("truth", TRUTH.stroke_width(4), truth), ("estimate", ESTIMATE.stroke_width(1), estimate)],
        )?;
    }
    if let Some(panel) = panels.get(angles.len()) {
        let error =
            |point: &Point| point.truth.and_then(|truth| OrientationError::between(&point.estimate, &truth));
        let has_heading = outcome.has_heading;
        let heading =
            line(series, |point| error(point).filter(|_| has_heading).map(|error| error.heading.to_degrees()));
        let inclination = line(series, |point| error(point).map(|error| error.inclination.to_degrees()));
        panel_of(
            panel,
            "error",
            &[("heading", ERROR.stroke_width(1), heading), ("inclination", ESTIMATE.stroke_width(1), inclination)],
        )?;
    }
    root.present().map_err(|error| format!("cannot write {}: {error}", file.display()))?;
    Ok(())
}

/// Whether a plot can be written there: asked before the run, and told in plain words.
pub(crate) fn check(file: &Path) -> Result<(), String> {
    if file.extension().is_none_or(|end| end != "png") {
        return Err(format!("--plot writes a PNG: call the file {}", file.with_extension("png").display()));
    }
    match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() && !folder.is_dir() => {
            Err(format!("there is no folder {} to plot into", folder.display()))
        }
        _ => Ok(()),
    }
}

/// Runs of points without a gap; a jump from one end of the circle to the other is a gap as well.
fn line(series: &Series, value: impl Fn(&Point) -> Option<f64>) -> Vec<Vec<(f64, f64)>> {
    let every = series.len().div_ceil(MOST_POINTS).max(1);
    let mut runs: Vec<Vec<(f64, f64)>> = vec![Vec::new()];
    for point in series.points.iter().step_by(every) {
        let Some(run) = runs.last_mut() else { continue };
        match value(point) {
            Some(value) if run.last().is_none_or(|(_, last)| (value - last).abs() < 180.0) => {
                run.push((point.time_s, value));
            }
            Some(value) => runs.push(vec![(point.time_s, value)]),
            None if !run.is_empty() => runs.push(Vec::new()),
            None => {}
        }
    }
    runs
}

/// Label, style, runs of points.
type Line = (&'static str, ShapeStyle, Vec<Vec<(f64, f64)>>);

fn panel_of(
    panel: &DrawingArea<BitMapBackend<'_>, plotters::coord::Shift>,
    name: &str,
    lines: &[Line],
) -> Result<(), Box<dyn Error>> {
    let points = || lines.iter().flat_map(|(_, _, runs)| runs.iter().flatten());
    let (mut start, mut end, mut low, mut high) = (f64::MAX, f64::MIN, f64::MAX, f64::MIN);
    for (time, value) in points() {
        (start, end) = (start.min(*time), end.max(*time));
        (low, high) = (low.min(*value), high.max(*value));
    }
    if start >= end {
        return Ok(());
    }
    let margin = ((high - low) * 0.05).max(0.1);
    let mut chart = ChartBuilder::on(panel)
        .margin(6)
        .x_label_area_size(28)
        .y_label_area_size(60)
        .build_cartesian_2d(start..end, low - margin..high + margin)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .y_desc(format!("{name}, deg over s"))
        .label_style(("sans-serif", 14))
        .draw()?;
    for (label, style, runs) in lines {
        let mut labelled = false;
        for run in runs.iter().filter(|run| !run.is_empty()) {
            // Thick lines have spikes at sharp turns; dots do not.
            let drawn = if style.stroke_width > 1 {
                chart.draw_series(run.iter().map(|point| Circle::new(*point, 2, style.filled())))?
            } else {
                chart.draw_series(LineSeries::new(run.iter().copied(), *style))?
            };
            if !labelled {
                let style = *style;
                drawn.label(*label).legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], style));
                labelled = true;
            }
        }
    }
    chart
        .configure_series_labels()
        .background_style(WHITE.mix(0.8))
        .label_font(("sans-serif", 14))
        .position(SeriesLabelPosition::UpperRight)
        .draw()?;
    Ok(())
}
