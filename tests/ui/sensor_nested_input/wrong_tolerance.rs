//! An estimator in a sensor has nothing to be in step with.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1") {
            estimator tilt: Tilt(gain = 0.2) { sync_tolerance: 20 ms; }
        }
    }
}

fn main() {}
