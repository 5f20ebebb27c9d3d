//! Orientation on the trials of BROAD: the mean over them of the RMS errors, one parameter set for all.

use crate::recordings::broad;
use bb_bags::{BagImu, Truth};
use bb_cli::{Averages, Degrees, Score};
use bb_core::prelude::*;
use bb_estimators::{Complementary, Madgwick, Mekf};
use std::error::Error;
use std::path::Path;

robot! {
    /// All filters on one recorded IMU, each with nine axes and with six.
    robot Recorded;

    link body {
        sensor imu: BagImu() {
            estimator madgwick: Madgwick<Marg>(beta = 0.12);
            estimator madgwick_six: Madgwick<Marg>(beta = 0.03, magnetometer = false);
            estimator complementary: Complementary<Marg>();
            estimator complementary_six: Complementary<Marg>(magnetometer = false);
            estimator mekf: Mekf<Marg>();
            estimator mekf_six: Mekf<Marg>(magnetometer = false);
        }
    }
}

/// Of each filter.
type Errors = [Degrees; 6];

pub(crate) fn errors(file: &Path) -> Result<Errors, Box<dyn Error>> {
    let truth = Truth::read(&bb_bags::Bag::open(file)?)?;
    let mut builder = Recorded::builder();
    builder.options(recorded::sensor::body::imu).file = file.to_owned();
    let mut filters = [
        builder.subscribe(recorded::sensor::body::imu::madgwick),
        builder.subscribe(recorded::sensor::body::imu::madgwick_six),
        builder.subscribe(recorded::sensor::body::imu::complementary),
        builder.subscribe(recorded::sensor::body::imu::complementary_six),
        builder.subscribe(recorded::sensor::body::imu::mekf),
        builder.subscribe(recorded::sensor::body::imu::mekf_six),
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
    let [a, b, c, d, e, f] = filters.map(|(_, score)| score.rms().ok_or("no sample moves and has truth"));
    Ok([a?, b?, c?, d?, e?, f?])
}

#[test]
fn mean_errors_on_broad() -> Result<(), Box<dyn Error>> {
    let Some(files) = broad() else { return Ok(()) };
    let errors = files.iter().map(|file| errors(file)).collect::<Result<Vec<_>, _>>()?;
    let means: [[f64; 3]; 6] = std::array::from_fn(|filter| {
        let averages = Averages::of(errors.iter().map(|errors| errors[filter]));
        let mean = averages.map(|averages| averages.mean);
        mean.map_or([f64::NAN; 3], |mean| [mean.total, mean.heading, mean.inclination])
    });
    if files.len() != 10 {
        println!("{} trials instead of 10: no bounds are known for these", files.len());
        return Ok(());
    }
    // Measured, degrees; six axes have no heading.
    let known = [
        ("Madgwick, nine axes", means[0], [5.252, 4.194, 3.005]),
        ("Madgwick, six axes", means[1], [f64::INFINITY, f64::INFINITY, 1.996]),
        ("complementary, nine axes", means[2], [3.701, 3.095, 1.801]),
        ("complementary, six axes", means[3], [f64::INFINITY, f64::INFINITY, 1.801]),
        ("Kalman filter, nine axes", means[4], [1.171, 0.968, 0.620]),
        ("Kalman filter, six axes", means[5], [f64::INFINITY, f64::INFINITY, 0.621]),
    ];
    for (name, measured, known) in known {
        println!("{name}: total {:.3}, heading {:.3}, inclination {:.3}", measured[0], measured[1], measured[2]);
        for (measured, known) in measured.iter().zip(known) {
            assert!(*measured <= known * 1.02, "{name}: {measured} was {known}");
        }
    }
    // The published figure of Madgwick with nine axes at this beta is 5.27.
    assert!((means[0][0] / 5.27 - 1.0).abs() < 0.05);
    Ok(())
}
