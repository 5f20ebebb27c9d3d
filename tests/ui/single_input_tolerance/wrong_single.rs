//! A tolerance beside a single input.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1");
        estimator tilt: Tilt() {
            input imu: sensor::base::imu;
            sync_tolerance: 20 ms;
        }
    }
}

fn main() {}
