//! Nothing publishes but the estimator itself.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        estimator tilt: Tilt() { input imu: sensor::base::imu; }
    }
}

fn main() {}
