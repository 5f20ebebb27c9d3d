//! A sensor of the robot takes the name of the root link, below which paths would meet.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    sensors {
        sensor base: Bmi270(bus = "i2c-1") { estimator imu: Tilt(); }
    }
    link base { sensor imu: Bmi270(bus = "i2c-2"); }
}

fn main() {}
