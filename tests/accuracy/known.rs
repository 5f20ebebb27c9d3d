//! Accuracy of each filter on BROAD: `accuracy.csv` in its folder, which the tests are held against and the guide's tables are made from.
//! `UPDATE_ACCURACY=1` renews it.

use bb_estimators::attitude::FilterParams;
use bb_eval::{Averages, Axes, Chosen, Degrees, Setting};
use std::error::Error;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// A filter with settings, and its errors as they are known.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    pub(crate) filter: &'static str,
    pub(crate) axes: Axes,
    /// `NAME=VALUE`, several with `; `; empty for the defaults.
    pub(crate) settings: String,
    /// None before they were measured.
    pub(crate) errors: Option<Errors>,
}

/// Mean and worst over the trials.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Errors {
    pub(crate) mean: Degrees,
    pub(crate) worst: Degrees,
}

impl From<Averages> for Errors {
    fn from(averages: Averages) -> Self {
        Self { mean: averages.mean, worst: averages.worst }
    }
}

const HEADER: &str = "axes,settings,total,heading,inclination,worst total,worst heading,worst inclination";

impl Row {
    pub(crate) fn name(&self) -> String {
        format!(
            "{}, {} axes, {}",
            self.filter,
            self.axes.name(),
            if self.settings.is_empty() { "defaults" } else { &self.settings }
        )
    }

    pub(crate) fn chosen(&self) -> Result<Chosen, Box<dyn Error>> {
        let settings = self.settings.split("; ").filter(|setting| !setting.is_empty());
        let settings = settings.map(str::parse::<Setting>).collect::<Result<Vec<_>, _>>()?;
        Ok(Chosen::named(self.filter, self.axes, &settings)?)
    }

    fn parse(filter: &'static str, line: &str) -> Result<Self, Box<dyn Error>> {
        let cells: Vec<_> = line.split(',').collect();
        let [axes, settings, numbers @ ..] = &*cells else { return Err(format!("`{line}` has no cells").into()) };
        let axes = match *axes {
            "nine" => Axes::Nine,
            "six" => Axes::Six,
            other => return Err(format!("`{other}` is no number of axes").into()),
        };
        let number = |text: &&str| if text.is_empty() { Ok(f64::NAN) } else { text.parse::<f64>() };
        let numbers = numbers.iter().map(number).collect::<Result<Vec<_>, _>>()?;
        let &[total, heading, inclination, worst_total, worst_heading, worst_inclination] = &*numbers else {
            return Err(format!("`{line}` has not six numbers").into());
        };
        let errors = Errors {
            mean: Degrees { total, heading, inclination },
            worst: Degrees { total: worst_total, heading: worst_heading, inclination: worst_inclination },
        };
        Ok(Self { filter, axes, settings: (*settings).to_owned(), errors: Some(errors) })
    }

    fn line(&self) -> String {
        let mut line = format!("{},{}", self.axes.name(), self.settings);
        let Some(Errors { mean, worst }) = self.errors else { return line };
        for degrees in [mean, worst] {
            match self.axes {
                Axes::Nine => {
                    let _ = write!(line, ",{:.3},{:.3},{:.3}", degrees.total, degrees.heading, degrees.inclination);
                }
                // Without a field the heading starts anywhere.
                Axes::Six => {
                    let _ = write!(line, ",,,{:.3}", degrees.inclination);
                }
            }
        }
        line
    }
}

fn file(filter: &str) -> PathBuf {
    // Two crates compile this.
    let folders =
        Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().map(|folder| folder.join("bb-estimators/src/attitude"));
    let folder = folders.into_iter().find(|folder| folder.is_dir()).unwrap_or_default();
    folder.join(filter).join("accuracy.csv")
}

/// The rows of every filter of the list. One without a file has its defaults, with nine axes and with six, not yet
/// measured.
pub(crate) fn rows() -> Result<Vec<Row>, Box<dyn Error>> {
    let mut rows = Vec::new();
    for params in FilterParams::ALL.iter().map(|default| default()) {
        let filter = params.name();
        let Ok(text) = std::fs::read_to_string(file(filter)) else {
            let new = |axes| Row { filter, axes, settings: String::new(), errors: None };
            rows.extend([new(Axes::Nine), new(Axes::Six)]);
            continue;
        };
        let mut lines = text.lines();
        if lines.next() != Some(HEADER) {
            return Err(format!("{}: the first line is not `{HEADER}`", file(filter).display()).into());
        }
        for line in lines {
            rows.push(Row::parse(filter, line).map_err(|error| format!("{}: {error}", file(filter).display()))?);
        }
    }
    Ok(rows)
}

/// Returns whether the files are to be renewed instead of held against.
pub(crate) fn is_update() -> bool {
    std::env::var_os("UPDATE_ACCURACY").is_some()
}

pub(crate) fn write(rows: &[Row]) -> Result<(), Box<dyn Error>> {
    for rows in rows.chunk_by(|row, next| row.filter == next.filter) {
        let lines = rows.iter().map(Row::line);
        let text =
            [HEADER.to_owned()].into_iter().chain(lines).fold(String::new(), |text, line| text + &line + "\n");
        std::fs::write(file(rows[0].filter), text)?;
    }
    Ok(())
}
