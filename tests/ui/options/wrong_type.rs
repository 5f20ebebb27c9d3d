//! Values of other types than the options'.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = 1, averages = 2.5) { estimator tilt: Tilt(gain = "high"); }
    }
}

fn main() {}
