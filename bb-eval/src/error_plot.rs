//! Plots of errors over time: one panel per recording, one line per filter.

use crate::evaluate::Evaluation;
use crate::filters::Axes;
use crate::report::name;
use bb_plot::{Line, PALETTE, Panel, Picture};
use std::path::Path;

/// Most viewers cannot open larger pictures.
const MOST_PANELS: usize = 40;

/// Writes a plot of the errors of attitude filters over time: one panel per recording, one line per filter.
///
/// # Errors
/// There are none, too many, or they cannot be written there.
pub fn plot_errors(file: &Path, evaluations: &[Evaluation], axes: Axes) -> Result<(), String> {
    let panels: Vec<_> = evaluations.iter().filter_map(|evaluation| panel(evaluation, evaluations)).collect();
    if panels.is_empty() {
        return Err(format!("{}: not plotted, for no recording has errors", file.display()));
    }
    if panels.len() > MOST_PANELS {
        let count = panels.len();
        return Err(format!("--plot draws at most {MOST_PANELS} recordings, and {count} have errors; name fewer"));
    }
    let title = format!("{}, {} axes", angle(axes), axes.name());
    Picture { title, panels, panel_size: (1400, 260) }.write(file)
}

fn angle(axes: Axes) -> &'static str {
    match axes {
        Axes::Six => "inclination error",
        Axes::Nine => "total error",
    }
}

fn panel(evaluation: &Evaluation, all: &[Evaluation]) -> Option<Panel> {
    let runs = evaluation.runs.as_ref().ok()?;
    let has_errors = runs.iter().any(|run| run.errors.iter().any(|(_, error)| error.is_some()));
    let line = |(index, run): (usize, &crate::Run)| {
        let colour = PALETTE[index % PALETTE.len()];
        Line::peaks(run.filter, colour, 1, &run.errors)
    };
    let lines = runs.iter().enumerate().map(line).collect();
    has_errors.then(|| Panel {
        title: name(evaluation, all),
        axis: format!("{} (deg)", angle(evaluation.axes)),
        lines,
    })
}
