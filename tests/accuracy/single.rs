//! Every filter in `f32` beside itself in `f64`, on the trials of BROAD.

use super::known::{self, Row};
use bb_core::nalgebra::{Quaternion, UnitQuaternion};
use bb_estimators::attitude::{AnyFilter, AnyParams, AttitudeFilter, ImuSample, Real};
use bb_eval::{Averages, Axes, Degrees, End, Recording, Score, Topics};
use bb_tests::recordings::broad;
use std::error::Error;

/// The greatest error in `f32`, as a multiple of that in `f64`.
const MOST: f64 = 1.001;

fn score<T: Real>(recording: &Recording, samples: &[ImuSample], row: &Row) -> Result<Degrees, Box<dyn Error>> {
    let mut filter = AnyFilter::<T>::new(AnyParams { filter: *row.chosen()?.params() })?;
    let mut score = Score::default();
    for sample in samples {
        filter.update(&sample.cast())?;
        if let Some(estimate) = filter.world_from_body() {
            let components = estimate.coords.map(|component| component.as_f64());
            let estimate = UnitQuaternion::new_normalize(Quaternion::from(components));
            score.add_at(&recording.truth, sample.time_ns, &estimate);
        }
    }
    Ok(score.rms().ok_or("no sample moves and has truth")?)
}

#[test]
fn single_precision_is_as_accurate() -> Result<(), Box<dyn Error>> {
    let rows = known::rows()?;
    let files = broad()?;
    let mut errors = Vec::new();
    for file in &files {
        let mut recording = Recording::open(file, &Topics::default(), Axes::Nine, None)?;
        let mut samples = Vec::new();
        while let End::NotYet = recording.read(&mut samples, usize::MAX)? {}
        let both = |row: &Row| -> Result<[Degrees; 2], Box<dyn Error>> {
            Ok([score::<f64>(&recording, &samples, row)?, score::<f32>(&recording, &samples, row)?])
        };
        errors.push(rows.iter().map(both).collect::<Result<Vec<_>, _>>()?);
    }
    for (index, row) in rows.iter().enumerate() {
        let averages = |scalar: usize| Averages::of(errors.iter().map(|errors| errors[index][scalar]));
        let (Some(double), Some(single)) = (averages(0), averages(1)) else { return Err("no recording".into()) };
        let worst = errors.iter().map(|errors| errors[index][1].inclination / errors[index][0].inclination);
        println!(
            "{}: total {:.4} in f64, {:.4} in f32; inclination {:.4}, {:.4}, on one trial at most {:.4} times",
            row.name(),
            double.mean.total,
            single.mean.total,
            double.mean.inclination,
            single.mean.inclination,
            worst.fold(0.0, f64::max),
        );
        assert!(single.mean.inclination <= MOST * double.mean.inclination, "{}", row.name());
        assert!(row.axes == Axes::Six || single.mean.total <= MOST * double.mean.total, "{}", row.name());
    }
    Ok(())
}
