//! A robot without commands, and a link-nested estimator.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1");
        estimator tilt: Tilt() {
            input imu: imu;
            lost_after: 100 ms;
            on_lost: stop;
        }
    }
}

fn main() {}
