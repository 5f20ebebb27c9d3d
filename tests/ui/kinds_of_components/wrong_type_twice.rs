//! One type that is no estimator, declared twice.

use bb_core::prelude::*;

#[derive(Debug)]
struct Filter;

robot! {
    robot Rover;

    link base {
        sensor left: External<Imu>() { estimator tilt: Filter(); }
        sensor right: External<Imu>() { estimator tilt: Filter(); }
    }
}

fn main() {}
