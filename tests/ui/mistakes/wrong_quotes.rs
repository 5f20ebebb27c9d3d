//! Text in single quotes, as in Python.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base { sensor imu: Bmi270(bus = 'i2c-1'); }
}

fn main() {}
