//! A magnetic field where an inertial sample is taken.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor field: Magnetometer();
        estimator tilt: Tilt() { input imu: sensor::base::field; }
    }
}

fn main() {}
