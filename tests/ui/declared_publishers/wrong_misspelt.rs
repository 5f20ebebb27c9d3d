//! Paths with a slip: in the last name, in the first, two names short.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1");
        estimator a: Tilt() { input imu: sensor::base::inu; }
        estimator b: Tilt() { input imu: sensors::base::imu; }
    }
}

fn main() {}
