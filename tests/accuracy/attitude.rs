//! Orientation on the trials of BROAD: the mean over them of the RMS errors, one parameter set for all.

use crate::recordings::broad;
use bb_cli::{Averages, Degrees, Score};
use bb_core::prelude::*;
use bb_estimators::{Complementary, Fusion, Madgwick, Mahony, Mekf, Tilt, Vqf};
use bb_mcap::{BagImu, Truth};
use std::error::Error;
use std::path::Path;

robot! {
    /// All filters on one recorded IMU, each with nine axes and with six.
    robot Recorded;

    link body {
        sensor imu: BagImu() {
            estimator madgwick: Madgwick<Marg>(beta = 0.12 rad/s);
            estimator madgwick_six: Madgwick<Marg>(beta = 0.03 rad/s, magnetometer = false);
            estimator complementary: Complementary<Marg>();
            estimator complementary_six: Complementary<Marg>(magnetometer = false);
            estimator mekf: Mekf<Marg>();
            estimator mekf_six: Mekf<Marg>(magnetometer = false);
            estimator mahony: Mahony<Marg>(proportional_gain = 0.74, integral_gain = 0.0012);
            estimator mahony_six: Mahony<Marg>(proportional_gain = 0.18, integral_gain = 0.0015, magnetometer = false);
            estimator vqf: Vqf<Marg>();
            estimator vqf_six: Vqf<Marg>(magnetometer = false);
            estimator fusion: Fusion<Marg>(gain = 0.1, recovery_time = 20 s);
            estimator fusion_six: Fusion<Marg>(gain = 0.1, recovery_time = 20 s, magnetometer = false);
            estimator fusion_published: Fusion<Marg>();
            estimator tilt: Tilt<Marg>();
            estimator tilt_six: Tilt<Marg>(magnetometer = false);
        }
    }
}

/// Total, heading and inclination, degrees.
type Errors = [f64; 3];

/// Six axes have no heading.
const ANY: f64 = f64::INFINITY;

/// Each filter's name and its mean errors as measured.
const KNOWN: [(&str, Errors); 15] = [
    ("Madgwick, nine axes", [5.252, 4.194, 3.005]),
    ("Madgwick, six axes", [ANY, ANY, 1.996]),
    ("complementary, nine axes", [3.701, 3.095, 1.801]),
    ("complementary, six axes", [ANY, ANY, 1.801]),
    ("Kalman filter, nine axes", [1.113, 0.902, 0.619]),
    ("Kalman filter, six axes", [ANY, ANY, 0.621]),
    ("Mahony, nine axes", [8.316, 6.881, 4.511]),
    ("Mahony, six axes", [ANY, ANY, 3.393]),
    ("VQF, nine axes", [2.177, 2.010, 0.765]),
    ("VQF, six axes", [ANY, ANY, 0.765]),
    ("Fusion, nine axes", [4.402, 3.585, 2.302]),
    ("Fusion, six axes", [ANY, ANY, 2.302]),
    ("Fusion, nine axes, as published", [8.686, 5.471, 5.744]),
    ("tilt, nine axes", [50.578, 40.631, 32.316]),
    ("tilt, six axes", [ANY, ANY, 32.316]),
];

/// Means that others have measured with their own code, the parameter sets being the same: the filter's place in
/// [`KNOWN`], which of its errors, degrees, and by which fraction ours may differ.
const PUBLISHED: [(usize, usize, f64, f64); 7] = [
    (0, 0, 5.27, 0.02),
    (6, 0, 8.32, 0.02),
    (7, 2, 3.34, 0.02),
    (8, 0, 2.18, 0.005),
    (8, 1, 2.01, 0.005),
    (8, 2, 0.77, 0.01),
    (9, 2, 0.77, 0.01),
];

/// The errors on one recording, in the order of [`KNOWN`].
pub(crate) fn errors(file: &Path) -> Result<[Degrees; KNOWN.len()], Box<dyn Error>> {
    let truth = Truth::read(&bb_mcap::Bag::open(file)?)?;
    let mut builder = Recorded::builder();
    builder.options(recorded::sensor::body::imu).file = file.to_owned();
    let mut filters = [
        builder.subscribe(recorded::sensor::body::imu::madgwick),
        builder.subscribe(recorded::sensor::body::imu::madgwick_six),
        builder.subscribe(recorded::sensor::body::imu::complementary),
        builder.subscribe(recorded::sensor::body::imu::complementary_six),
        builder.subscribe(recorded::sensor::body::imu::mekf),
        builder.subscribe(recorded::sensor::body::imu::mekf_six),
        builder.subscribe(recorded::sensor::body::imu::mahony),
        builder.subscribe(recorded::sensor::body::imu::mahony_six),
        builder.subscribe(recorded::sensor::body::imu::vqf),
        builder.subscribe(recorded::sensor::body::imu::vqf_six),
        builder.subscribe(recorded::sensor::body::imu::fusion),
        builder.subscribe(recorded::sensor::body::imu::fusion_six),
        builder.subscribe(recorded::sensor::body::imu::fusion_published),
        builder.subscribe(recorded::sensor::body::imu::tilt),
        builder.subscribe(recorded::sensor::body::imu::tilt_six),
    ]
    .map(|orientation| (orientation, Score::default()));
    let mut simulation = builder.simulate()?;
    while simulation.step() {
        for (orientation, score) in &mut filters {
            for message in orientation.drain() {
                score.add_at(&truth, message.monotonic_time.as_nanos(), &message.world_from_body);
            }
        }
    }
    simulation.stop().ok()?;
    let scores = filters.map(|(_, score)| score.rms().ok_or("no sample moves and has truth"));
    Ok(scores.into_iter().collect::<Result<Vec<_>, _>>()?.try_into().map_err(|_| "as many as filters")?)
}

#[test]
fn mean_errors_on_broad() -> Result<(), Box<dyn Error>> {
    let Some(files) = broad()? else { return Ok(()) };
    let errors = files.iter().map(|file| errors(file)).collect::<Result<Vec<_>, _>>()?;
    let averages: Vec<_> = (0..KNOWN.len())
        .map(|filter| Averages::of(errors.iter().map(|errors| errors[filter])).ok_or("there are trials"))
        .collect::<Result<_, _>>()?;
    let angles = |errors: Degrees| [errors.total, errors.heading, errors.inclination];
    let means: Vec<Errors> = averages.iter().map(|averages| angles(averages.mean)).collect();
    for ((name, _), averages) in KNOWN.iter().zip(&averages) {
        let (mean, worst) = (angles(averages.mean), angles(averages.worst));
        println!(
            "{name}: total {:.3}, heading {:.3}, inclination {:.3}; worst {:.3}, {:.3}, {:.3}",
            mean[0], mean[1], mean[2], worst[0], worst[1], worst[2]
        );
    }
    for ((name, known), mean) in KNOWN.iter().zip(&means) {
        for (measured, known) in mean.iter().zip(known) {
            assert!(*measured <= known * 1.02, "{name}: {measured} was {known}");
        }
    }
    for (filter, angle, published, fraction) in PUBLISHED {
        let (name, measured) = (KNOWN[filter].0, means[filter][angle]);
        assert!((measured / published - 1.0).abs() < fraction, "{name}: {measured}, published {published}");
    }
    Ok(())
}
