//! An estimator that takes what it publishes.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        estimator tilt: Tilt() { input imu: estimator::base::tilt; }
    }
}

fn main() {}
