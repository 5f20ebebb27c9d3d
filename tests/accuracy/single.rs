//! Every filter in `f32` beside itself in `f64`, on the trials of BROAD.

use crate::recordings::broad;
use bb_cli::{Averages, Axes, Degrees, End, Recording, Score, Topics};
use bb_core::nalgebra::{Quaternion, UnitQuaternion};
use bb_estimators::attitude::{
    AttitudeFilter, ComplementaryFilter, ComplementaryParams, FusionFilter, FusionParams, ImuSample,
    MadgwickFilter, MadgwickParams, MahonyFilter, MahonyParams, MekfFilter, MekfParams, Real, TiltFilter,
    TiltParams, VqfFilter, VqfParams,
};
use std::error::Error;

/// The greatest error in `f32`, as a multiple of that in `f64`.
const MOST: f64 = 1.001;

/// A filter's name, and its errors on one recording in `f64` and in `f32`.
struct Compared {
    name: &'static str,
    run: Run,
}

type Run = fn(&Recording, &[ImuSample]) -> Result<[Degrees; 2], Box<dyn Error>>;

/// Writes the comparison of one filter: its type without the scalar, and its parameters.
macro_rules! compared {
    ($name:literal, $filter:ident, $params:expr) => {
        Compared {
            name: $name,
            run: |recording, samples| {
                let double = score::<f64, _>(recording, samples, $filter::new($params)?)?;
                Ok([double, score::<f32, _>(recording, samples, $filter::new($params)?)?])
            },
        }
    };
}

const COMPARED: &[Compared] = &[
    compared!("mekf, nine axes", MekfFilter, MekfParams::default()),
    compared!("mekf, six axes", MekfFilter, MekfParams { magnetometer: false, ..MekfParams::default() }),
    compared!("VQF, nine axes", VqfFilter, VqfParams::default()),
    compared!("VQF, six axes", VqfFilter, VqfParams { magnetometer: false, ..VqfParams::default() }),
    compared!("complementary, nine axes", ComplementaryFilter, ComplementaryParams::default()),
    compared!(
        "Fusion, nine axes",
        FusionFilter,
        FusionParams { gain: 0.1, recovery_time: 20.0, ..FusionParams::default() }
    ),
    compared!("Madgwick, nine axes", MadgwickFilter, MadgwickParams { beta: 0.12, magnetometer: true }),
    compared!("Madgwick, six axes", MadgwickFilter, MadgwickParams { beta: 0.03, magnetometer: false }),
    compared!("Mahony, nine axes", MahonyFilter, MahonyParams::default()),
    compared!("tilt, nine axes", TiltFilter, TiltParams::default()),
];

fn score<T: Real, F: AttitudeFilter<T>>(
    recording: &Recording,
    samples: &[ImuSample],
    mut filter: F,
) -> Result<Degrees, Box<dyn Error>> {
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
    let Some(files) = broad()? else { return Ok(()) };
    let mut errors = Vec::new();
    for file in &files {
        let mut recording = Recording::open(file, &Topics::default(), Axes::Nine, None)?;
        let mut samples = Vec::new();
        while let End::NotYet = recording.read(&mut samples, usize::MAX)? {}
        let one: Result<Vec<_>, _> = COMPARED.iter().map(|compared| (compared.run)(&recording, &samples)).collect();
        errors.push(one?);
    }
    for (filter, compared) in COMPARED.iter().enumerate() {
        let averages = |scalar: usize| Averages::of(errors.iter().map(|errors| errors[filter][scalar]));
        let (Some(double), Some(single)) = (averages(0), averages(1)) else { return Err("no recording".into()) };
        let worst = errors.iter().map(|errors| errors[filter][1].inclination / errors[filter][0].inclination);
        println!(
            "{}: total {:.4} in f64, {:.4} in f32; inclination {:.4}, {:.4}, on one trial at most {:.4} times",
            compared.name,
            double.mean.total,
            single.mean.total,
            double.mean.inclination,
            single.mean.inclination,
            worst.fold(0.0, f64::max),
        );
        assert!(single.mean.inclination <= MOST * double.mean.inclination, "{}", compared.name);
        let six = compared.name.ends_with("six axes");
        assert!(six || single.mean.total <= MOST * double.mean.total, "{}", compared.name);
    }
    Ok(())
}
