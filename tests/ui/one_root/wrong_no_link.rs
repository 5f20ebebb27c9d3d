//! A robot without a link.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    sensors { sensor imu: Bmi270(bus = "i2c-1"); }
}

fn main() {}
