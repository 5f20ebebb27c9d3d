//! Every filter on every family, beside what is stored.

use super::known::is_update;
use super::known_families::{self, Row};
use bb_estimators::attitude::FilterParams;
use bb_eval::{Axes, Chosen, FAMILIES, FamilyScore, Half, score_families};
use bb_tests::recordings;
use std::error::Error;

/// Errors and deviations change by less than this part, or `families.csv` has to be renewed;
const CHANGE: f64 = 0.02;
/// the worst trial, which is one of them and may be chaotic, by less than this part;
const WORST: f64 = 0.05;
/// and shares by less than this.
const SHARE: f64 = 0.02;

fn row(score: &FamilyScore) -> Result<Row, Box<dyn Error>> {
    let family = score.family;
    let averages = score.averages().ok_or_else(|| format!("{}: no trial", family.name))?;
    let (mean, worst) = (averages.mean, family.measure.of(&averages.worst));
    Ok(Row {
        family: family.name.into(),
        half: family.half.map_or("", Half::name).into(),
        angle: family.measure.name().into(),
        filter: score.filter.into(),
        errors: [mean.total, mean.heading, mean.inclination, worst],
        shares: [score.heading, score.tilt].map(|share| share.fraction().unwrap_or(f64::NAN)),
        median: score.median_deviation().unwrap_or(f64::NAN),
    })
}

/// Compares a figure with the stored one; either both are absent, or both are there.
fn is_near(measured: &Row, known: &Row) -> bool {
    let by_part = |measured: f64, known: f64, part: f64| {
        (measured.is_nan() && known.is_nan()) || (measured / known - 1.0).abs() < part
    };
    let by_share =
        |(measured, known): (&f64, &f64)| (measured.is_nan() && known.is_nan()) || (measured - known).abs() < SHARE;
    let ([total, heading, inclination, worst], known_errors) = (measured.errors, known.errors);
    by_part(total, known_errors[0], CHANGE)
        && by_part(heading, known_errors[1], CHANGE)
        && by_part(inclination, known_errors[2], CHANGE)
        && by_part(worst, known_errors[3], WORST)
        && measured.shares.iter().zip(&known.shares).all(by_share)
        && by_part(measured.median, known.median, CHANGE)
}

#[test]
fn families_are_as_they_are_stored() -> Result<(), Box<dyn Error>> {
    let data = recordings::families()?;
    let filters = FilterParams::ALL.iter().map(|default| default()).filter(|filter| Axes::Nine.suit(filter));
    let filters = Chosen::all(&filters.collect::<Vec<_>>(), Axes::Nine, &[])?;
    let scores = score_families(Some(&data), &FAMILIES, &filters)?;
    let rows = scores.iter().map(row).collect::<Result<Vec<_>, _>>()?;
    if is_update() {
        return known_families::write(&rows);
    }
    let known = known_families::rows()?;
    let mut changed = Vec::new();
    for measured in &rows {
        let stored = known.iter().find(|stored| stored.is_of(measured));
        if !stored.is_some_and(|stored| is_near(measured, stored)) {
            changed.push(format!("{measured:?}, was {stored:?}"));
        }
    }
    assert!(changed.is_empty(), "UPDATE_ACCURACY=1 renews the figures, if that is meant: {changed:#?}");
    assert_eq!(rows.len(), known.len(), "UPDATE_ACCURACY=1 takes away the families that are gone");
    Ok(())
}
