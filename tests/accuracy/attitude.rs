//! Orientation on the trials of BROAD: the mean over them of the RMS errors, one parameter set for all.

use super::known::{self, Errors, Row};
use bb_eval::{Averages, Axes, Degrees, Evaluator, Progress, evaluate_variant};
use bb_tests::recordings::broad;
use std::error::Error;
use std::path::Path;

/// Figures change by less than this part, or `accuracy.csv` has to be renewed.
const CHANGE: f64 = 0.02;

/// Means that others have measured with their own code, the parameter sets being the same: filter, axes, settings, which of
/// the errors, degrees, and by which part ours may differ.
type Published = (&'static str, Axes, &'static str, fn(&Degrees) -> f64, f64, f64);

const PUBLISHED: [Published; 7] = [
    ("madgwick", Axes::Nine, "beta=0.12 rad/s", |errors| errors.total, 5.27, 0.02),
    ("mahony", Axes::Nine, "", |errors| errors.total, 8.32, 0.02),
    ("mahony", Axes::Six, "proportional_gain=0.18; integral_gain=0.0015", |errors| errors.inclination, 3.34, 0.02),
    ("vqf", Axes::Nine, "", |errors| errors.total, 2.18, 0.005),
    ("vqf", Axes::Nine, "", |errors| errors.heading, 2.01, 0.005),
    ("vqf", Axes::Nine, "", |errors| errors.inclination, 0.77, 0.01),
    ("vqf", Axes::Six, "", |errors| errors.inclination, 0.77, 0.01),
];

/// The errors of each row on one recording, as `bb eval attitude` has them.
pub(crate) fn errors(file: &Path, rows: &[Row]) -> Result<Vec<Degrees>, Box<dyn Error>> {
    let evaluator = Evaluator::new(rows.iter().map(Row::chosen).collect::<Result<_, _>>()?, Axes::Nine);
    let evaluation = evaluate_variant(file, 0, &evaluator, &Progress::new("", 0));
    let scores = evaluation.runs?.into_iter().map(|run| run.score.rms().ok_or("no sample moves and has truth"));
    Ok(scores.collect::<Result<_, _>>()?)
}

#[test]
fn mean_errors_on_broad() -> Result<(), Box<dyn Error>> {
    let mut rows = known::rows()?;
    let files = broad()?;
    let errors = files.iter().map(|file| errors(file, &rows)).collect::<Result<Vec<_>, _>>()?;
    let mut changed = Vec::new();
    for (index, row) in rows.iter_mut().enumerate() {
        let averages = Averages::of(errors.iter().map(|errors| errors[index])).ok_or("there are trials")?;
        let measured = Errors::from(averages);
        println!("{}: {:.3?}, worst {:.3?}", row.name(), angles(&measured.mean, row), angles(&measured.worst, row));
        let known = row.errors.replace(measured);
        let is_near = known.is_some_and(|known| {
            let pairs = angles(&measured.mean, row).into_iter().zip(angles(&known.mean, row));
            pairs.into_iter().all(|(measured, known)| (measured / known - 1.0).abs() < CHANGE)
        });
        if !is_near {
            changed.push(format!("{}: {:?}, was {:?}", row.name(), measured.mean, known.map(|known| known.mean)));
        }
    }
    if known::is_update() {
        known::write(&rows)?;
    } else {
        assert!(changed.is_empty(), "UPDATE_ACCURACY=1 renews the figures, if that is meant: {changed:#?}");
    }
    for (filter, axes, settings, of, published, part) in PUBLISHED {
        let is_it = |row: &&Row| (row.filter, row.axes, &*row.settings) == (filter, axes, settings);
        let row = rows.iter().find(is_it).ok_or_else(|| format!("{filter} with `{settings}` is not measured"))?;
        let measured = row.errors.map(|errors| of(&errors.mean)).ok_or("measured")?;
        assert!((measured / published - 1.0).abs() < part, "{}: {measured}, published {published}", row.name());
    }
    Ok(())
}

/// Returns the errors that count with these axes.
fn angles(errors: &Degrees, row: &Row) -> Vec<f64> {
    match row.axes {
        Axes::Nine => vec![errors.total, errors.heading, errors.inclination],
        Axes::Six => vec![errors.inclination],
    }
}
