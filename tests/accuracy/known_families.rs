//! Errors of each filter on each family of trials: `families.csv`, which the test is held against and the guide's table is
//! made from. `UPDATE_ACCURACY=1` renews it.

use std::error::Error;
use std::fmt::Write;
use std::path::{Path, PathBuf};

const HEADER: &str = "family,half,angle,filter,total,heading,inclination,worst,heading in 2σ,tilt in 2σ,median σ";

/// The figures of one filter on one family.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Row {
    pub(crate) family: String,
    /// A or B, or empty for a part of another family.
    pub(crate) half: String,
    /// The angle that counts.
    pub(crate) angle: String,
    pub(crate) filter: String,
    /// Means over the trials of total, heading and inclination, and the worst trial's angle that counts, degrees.
    pub(crate) errors: [f64; 4],
    /// The shares of headings and of inclinations within two standard deviations, from 0 to 1; NaN if none is reported.
    pub(crate) shares: [f64; 2],
    /// The median of the heading's standard deviations, degrees; NaN if none is reported.
    pub(crate) median: f64,
}

impl Row {
    pub(crate) fn is_of(&self, other: &Self) -> bool {
        (&self.family, &self.filter) == (&other.family, &other.filter)
    }

    fn parse(line: &str) -> Result<Self, Box<dyn Error>> {
        let cells: Vec<_> = line.split(',').collect();
        let &[family, half, angle, filter, ref numbers @ ..] = &*cells else {
            return Err(format!("`{line}` has not eleven cells").into());
        };
        let number = |text: &&str| if text.is_empty() { Ok(f64::NAN) } else { text.parse::<f64>() };
        let numbers = numbers.iter().map(number).collect::<Result<Vec<_>, _>>()?;
        let &[total, heading, inclination, worst, headings, tilts, median] = &*numbers else {
            return Err(format!("`{line}` has not seven numbers").into());
        };
        Ok(Self {
            family: family.into(),
            half: half.into(),
            angle: angle.into(),
            filter: filter.into(),
            errors: [total, heading, inclination, worst],
            shares: [headings, tilts],
            median,
        })
    }

    fn line(&self) -> String {
        let Self { family, half, angle, filter, .. } = self;
        let mut line = format!("{family},{half},{angle},{filter}");
        let numbers = [&self.errors[..], &self.shares, &[self.median]].concat();
        for number in numbers {
            let _ = if number.is_nan() { write!(line, ",") } else { write!(line, ",{number:.3}") };
        }
        line
    }
}

fn file() -> PathBuf {
    // Two crates compile this.
    let mut folders = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().map(|folder| folder.join("tests/accuracy"));
    folders.find(|folder| folder.is_dir()).unwrap_or_default().join("families.csv")
}

/// The rows of the file, in its order; none if there is no file.
pub(crate) fn rows() -> Result<Vec<Row>, Box<dyn Error>> {
    let Ok(text) = std::fs::read_to_string(file()) else { return Ok(Vec::new()) };
    let mut lines = text.lines();
    if lines.next() != Some(HEADER) {
        return Err(format!("{}: the first line is not `{HEADER}`", file().display()).into());
    }
    lines.map(Row::parse).collect()
}

pub(crate) fn write(rows: &[Row]) -> Result<(), Box<dyn Error>> {
    let lines = rows.iter().map(Row::line);
    let text = [HEADER.to_owned()].into_iter().chain(lines).fold(String::new(), |text, line| text + &line + "\n");
    Ok(std::fs::write(file(), text)?)
}
