//! `bb eval attitude` gives the figures of the filters in a robot: the same samples, the same score.

use super::attitude;
use super::known::{self, Row};
use bb_core::prelude::*;
use bb_estimators::attitude::{AnyFilter, AnyParams, Attitude};
use bb_eval::{Degrees, Score};
use bb_mcap::{BagImu, Truth};
use bb_tests::recordings::broad;
use std::error::Error;
use std::path::Path;

robot! {
    /// A filter on a recorded IMU.
    robot Recorded;

    link body {
        sensor imu: BagImu() { estimator orientation: Attitude<AnyFilter, Marg>(); }
    }
}

fn robot(file: &Path, row: &Row) -> Result<Degrees, Box<dyn Error>> {
    let truth = Truth::read(&bb_mcap::Bag::open(file)?)?;
    let mut builder = Recorded::builder();
    builder.options(recorded::sensor::body::imu).file = file.to_owned();
    *builder.options(recorded::sensor::body::imu::orientation) = AnyParams { filter: *row.chosen()?.params() };
    let orientation = builder.subscribe(recorded::sensor::body::imu::orientation);
    let mut score = Score::default();
    let mut simulation = builder.simulate()?;
    while simulation.step() {
        for message in orientation.drain() {
            score.add_at(&truth, message.monotonic_time.as_nanos(), &message.world_from_body);
        }
    }
    simulation.stop().ok()?;
    Ok(score.rms().ok_or("no sample moves and has truth")?)
}

#[test]
fn the_command_and_a_robot_agree() -> Result<(), Box<dyn Error>> {
    let rows = known::rows()?;
    // A disturbed one.
    for file in broad()?.into_iter().rev().take(1) {
        for (row, command) in rows.iter().zip(attitude::errors(&file, &rows)?) {
            assert_eq!(command, robot(&file, row)?, "{}, {}", row.name(), file.display());
        }
    }
    Ok(())
}
