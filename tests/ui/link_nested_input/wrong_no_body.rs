//! An estimator on a link takes nothing.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1");
        estimator tilt: Tilt();
    }
}

fn main() {}
