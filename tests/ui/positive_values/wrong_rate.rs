//! Rates that are none.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1") { rate: 0 Hz; }
        sensor field: Magnetometer() { rate: -50 Hz; }
    }
}

fn main() {}
