//! Numbers out of range.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1", full_scale = 5000 deg/s, averages = 0) {
            estimator tilt: Tilt(gain = -0.1);
        }
    }
}

fn main() {}
